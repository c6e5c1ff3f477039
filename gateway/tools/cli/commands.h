// The subcommands of baudgate: their options and help, and the function that each one runs.
// gateway/main.cpp passes the words in and runs the chosen Action.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <optional>
#include <ostream>
#include <span>
#include <string>
#include <string_view>

#include "config/catalog/catalog.h"

namespace baudgate::tools {

/// Returns a message if bit rate and format are two words (--serial 9600 8E1 without quotes),
/// because the parser takes the second word for another argument; empty: they are not. Must be
/// called before parsing.
std::optional<std::string> UnquotedSerial(std::span<char* const> words);

/// Prints a suggestion for each word that could not be parsed. Must be called after a parse error.
void TellMeant(const CLI::App& app, std::ostream& err);

/// The function of the chosen subcommand. Returns the exit code.
using Action = std::function<int(const config::Catalog&)>;

/// Adds all subcommands. The chosen subcommand sets `action` during parsing; `app` and `action`
/// must stay valid until parsing has ended.
void AddCommands(CLI::App& app, Action& action);
void AddClientCommands(CLI::App& app, Action& action);
void AddBusCommands(CLI::App& app, Action& action);
void AddDeviceCommands(CLI::App& app, Action& action);

/// True if `word` is at the position of a subcommand but is no subcommand. The caller then lists
/// the subcommands, because CLI11 does not list them.
bool IsUnknownSubcommand(const CLI::App& app, std::string_view word);

}  // namespace baudgate::tools
