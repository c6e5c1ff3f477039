// SPDX-License-Identifier: Apache-2.0
#include "gateway/cli/config_commands.h"

#include <iostream>
#include <memory>

#include "gateway/cli/offline/migrate.h"

namespace baudgate {

CLI::App& ConfigCommand(CLI::App& app) {
  const auto is_config = [](const CLI::App* one) { return one->get_name() == "config"; };
  for (CLI::App* there : app.get_subcommands(is_config)) return *there;
  auto* command = app.add_subcommand("config", "Configuration files");
  command->require_subcommand(1);
  return *command;
}

void AddMigrate(CLI::App& app, Action& action) {
  auto* command =
      ConfigCommand(app).add_subcommand("migrate", "Rewrite an older configuration or profile");
  auto options = std::make_shared<MigrateOptions>();
  command->add_option("FILE", options->file, "Configuration or profile; it is printed as rewritten")
      ->required();
  command->add_flag("--in-place", options->in_place, "Rewrite FILE itself, and keep FILE.bak");
  command->add_option("--protocol", options->protocol, "Of a profile");
  command->callback([options, &action] {
    action = [options](const auto& catalog) {
      return RunMigrate(*options, catalog, std::cout, std::cerr);
    };
  });
}

}  // namespace baudgate
