// The main function of the binary: parses the arguments, loads the protocol modules, and runs the
// subcommand.
// SPDX-License-Identifier: Apache-2.0
#include <iostream>

#include "config/catalog/modules.h"
#include "gateway/base/exit_code.h"
#include "gateway/base/log.h"
#include "gateway/base/version.h"
#include "gateway/process_start.h"
#include "gateway/tools/cli/commands.h"
#include "gateway/tools/terminal/command_end.h"
#include "gateway/tools/terminal/words.h"

int main(int argc, char** argv) {
  using namespace baudgate;
  HoldStandardDescriptors();
  SplitFromInit();
  CLI::App app(
      "baudgate: lines of SPA Bus, DCON, SET-4TM, Modbus, readers and telegrams to Modbus TCP and "
      "DDS",
      "baudgate");
  app.set_version_flag("--version", std::string("baudgate ") + kVersion);
  app.require_subcommand(1);
  tools::Action action;
  tools::AddCommands(app, action);
  tools::SetExample(app, "baudgate check -c baudgate.yaml");
  if (argc > 1 && tools::IsUnknownSubcommand(app, argv[1])) return kExitUsage;
  if (const auto mistake = tools::UnquotedSerial({argv, static_cast<std::size_t>(argc)})) {
    std::cerr << "baudgate: " << *mistake << '\n';
    return kExitUsage;
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (app.exit(error) == 0) return tools::AfterOutput(0);
    tools::TellMeant(app, std::cerr);
    return kExitUsage;
  }
  log::Begin(log::Level::info);
  const config::Modules modules = config::LoadModules();
  for (const std::string& refused : modules.refused) log::Warn("{}", refused);
  return tools::AfterOutput(action(modules.catalog));
}
