// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/bus_commands.h"

#include <unistd.h>

#include <iostream>
#include <memory>

#include "gateway/tools/cli/scan/ask.h"
#include "gateway/tools/cli/scan/scan.h"
#include "gateway/tools/terminal/live_table.h"
#include "gateway/tools/terminal/words.h"

namespace baudgate {
namespace {

void AddScan(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("scan", "Find the devices on a bus (only reads)");
  auto options = std::make_shared<ScanOptions>();
  command
      ->add_option("TARGET", options->target,
                   "A port (/dev/..., tcp://HOST:PORT), or a line of the running gateway")
      ->required();
  command->add_option("--protocol", options->protocol, "Only this protocol");
  command->add_option_function<std::string>(
      "--addresses",
      [options = options.get()](const std::string& text) {
        const auto addresses = scan::ParseAddresses(text);
        if (!addresses) throw CLI::ValidationError("--addresses", addresses.error());
        options->addresses = *addresses;
      },
      "Only these, for example 1-32");
  command->add_flag("--quick", options->quick, "Usual settings and addresses: under a minute");
  command->add_flag("--over-traffic", options->over_traffic,
                    "Also where somebody else speaks on the line");
  command->add_flag("--rs485", options->rs485, "The driver of the port switches the direction");
  command->add_option("--config", options->config, "Write a configuration of what was found");
  command->add_flag("--force", options->force, "Overwrite the file if it exists");
  command->add_flag("--json", options->json, "Print one JSON object a device");
  AddSocket(*command, options->socket);
  command->callback([options, &action] {
    action = [=](const auto& catalog) {
      options->width = TerminalWidth(STDOUT_FILENO);
      return RunScan(*options, catalog, std::cout, std::cerr);
    };
  });
}

void AddAsk(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("ask", "Send one telegram by hand, and say what comes back");
  auto options = std::make_shared<AskOptions>();
  command
      ->add_option("TARGET", options->target,
                   "A free port (/dev/..., tcp://HOST:PORT), or LINE or LINE.DEVICE of the "
                   "running gateway")
      ->required();
  command->add_option("TELEGRAM", options->telegram, "Text, as '>1RF:XX', or hex")->required();
  command->add_option("--protocol", options->protocol, "Of a port: the protocol");
  command->add_option("--serial", options->serial, "Of a port, for example \"9600 7E1\"");
  command->add_option_function<std::string>(
      "--checksum",
      [options = options.get()](const std::string& kind) {
        options->set.push_back("checksum=" + kind);
      },
      "Of a port: DCON true or false, SET-4TM crc or ks");
  command->add_option("--set", options->set, "Of a port: device option, key=value")
      ->take_all()
      ->allow_extra_args(false);
  command->add_option("--profile", options->profile, "Device profile, for names and units");
  command->add_flag("--rs485", options->rs485, "Of a port: its driver switches the direction");
  command->add_flag("--write", options->write, "It may write");
  command->add_flag("--json", options->json, "Print one JSON object");
  AddSocket(*command, options->socket);
  command->callback([options, &action] {
    action = [=](const auto& catalog) {
      options->width = TerminalWidth(STDOUT_FILENO);
      return RunAsk(*options, catalog, std::cout, std::cerr);
    };
  });
}

}  // namespace

void AddBusCommands(CLI::App& app, Action& action) {
  AddScan(app, action);
  AddAsk(app, action);
}

}  // namespace baudgate
