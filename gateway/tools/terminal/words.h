// Command-line options that several commands share, so that all commands spell them alike.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "gateway/base/time.h"

namespace baudgate::tools {

inline constexpr auto kInstalledConfig = "/etc/baudgate/baudgate.yaml";

/// Prints the help of a command. Prints its footer as an example above the usage.
class HelpWithExample : public CLI::Formatter {
 public:
  std::string make_usage(const CLI::App* app, std::string name) const override {
    return "Example: " + app->get_footer() + "\n" +
           CLI::Formatter::make_usage(app, std::move(name));
  }
  std::string make_footer(const CLI::App* /*app*/) const override { return {}; }
};

inline void SetExample(CLI::App& command, const std::string& example) {
  command.footer(example);
  command.formatter(std::make_shared<HelpWithExample>());
}

inline void AddSocket(CLI::App& command, std::string& socket) {
  command.add_option("--socket", socket,
                     "Control socket of the gateway; only needed if the gateway is not found");
}

inline CLI::Option* AddDuration(CLI::App& app, const std::string& name, Duration& target,
                                const std::string& help) {
  return app.add_option_function<std::string>(
      name,
      [&target](const std::string& text) {
        const auto duration = ParseDuration(text);
        if (!duration) throw CLI::ValidationError(duration.error());
        target = *duration;
      },
      help);
}

inline CLI::Option* AddSeconds(CLI::App& app, std::optional<Duration>& target) {
  constexpr double kMostSeconds = 1e9;
  return app.add_option_function<double>(
      "--seconds",
      [&target](const double& seconds) {
        if (!(seconds > 0 && seconds <= kMostSeconds)) {
          throw CLI::ValidationError("--seconds", "write a number above 0, for example 30");
        }
        target = std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
      },
      "End after this time");
}

}  // namespace baudgate::tools
