// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/mistakes.h"

#include <algorithm>
#include <string_view>
#include <vector>

#include "gateway/base/spelling.h"

namespace baudgate {
namespace {

bool IsNumber(std::string_view word) {
  return !word.empty() && word.find_first_not_of("0123456789") == std::string_view::npos;
}

/// "8E1"
bool IsFormat(std::string_view word) {
  constexpr std::string_view kParities = "NEOneo";
  return word.size() == 3 && word[0] >= '5' && word[0] <= '8' &&
         kParities.find(word[1]) != std::string_view::npos && (word[2] == '1' || word[2] == '2');
}

/// "baudgate certs dds": the last command that was understood.
struct Command {
  const CLI::App* app;
  std::string name;
};
Command LastOf(const CLI::App& app) {
  Command command{&app, app.get_name()};
  for (auto inner = app.get_subcommands(); !inner.empty(); inner = command.app->get_subcommands()) {
    command = {inner.front(), command.name + " " + inner.front()->get_name()};
  }
  return command;
}

std::vector<std::string> OptionsOf(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

std::vector<std::string> CommandsOf(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands({})) names.push_back(command->get_name());
  return names;
}

std::string MeantBy(const std::string& word, const Command& command) {
  const std::vector<std::string> options = OptionsOf(*command.app);
  const bool is_option = word.starts_with('-');
  const bool takes_file = std::ranges::find(options, "--config") != options.end();
  if (takes_file && (word.ends_with(".yaml") || word.ends_with(".yml"))) {
    return "give the file with -c: " + command.name + " -c " + word;
  }
  const std::vector<std::string> names = is_option ? options : CommandsOf(*command.app);
  const std::vector<std::string_view> known(names.begin(), names.end());
  const std::string_view meant = config::Nearest(word.substr(0, word.find('=')), known);
  return meant.empty() ? std::string()
                       : command.name + ": did you mean " + std::string(meant) + "?";
}

}  // namespace

std::optional<std::string> UnquotedSerial(std::span<char* const> words) {
  for (std::size_t i = 0; i + 2 < words.size(); ++i) {
    const std::string_view option = words[i];
    const bool split = (option == "--serial" || option == "--baud") && IsNumber(words[i + 1]) &&
                       IsFormat(words[i + 2]);
    if (!split) continue;
    return std::string(option) + ": bit rate and format are one word; write " +
           std::string(option) + " \"" + words[i + 1] + " " + words[i + 2] + "\"";
  }
  return std::nullopt;
}

void TellMeant(const CLI::App& app, std::ostream& err) {
  const Command command = LastOf(app);
  for (const std::string& word : app.remaining(true)) {
    const std::string meant = MeantBy(word, command);
    if (!meant.empty()) err << meant << '\n';
  }
}

}  // namespace baudgate
