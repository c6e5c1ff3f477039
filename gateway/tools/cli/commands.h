// The subcommands of baudgate: their words and help, and which function of gateway/tools/cli does
// each. Words come from gateway/main.cpp; what is to be done goes back to it. UnquotedSerial and
// TellMeant say what people mean by words that the command line does not take.
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

// What people mean by words that the command line does not take.

/// A bit rate whose format stands outside the quotes would be taken for another argument: says so
/// before the words are parsed. Empty: there is none.
std::optional<std::string> UnquotedSerial(std::span<char* const> words);

/// Behind an error of parsing: what each word that was not taken probably means.
void TellMeant(const CLI::App& app, std::ostream& err);

/// What the chosen subcommand does, once all words are parsed; returns the exit code.
using Action = std::function<int(const config::Catalog&)>;

/// Each subcommand sets `action` when it is the one that is parsed; both outlive the parsing.
void AddCommands(CLI::App& app, Action& action);
/// Those that talk to a running gateway.
void AddClientCommands(CLI::App& app, Action& action);
/// `scan` and `ask`: subcommands about a bus.
void AddBusCommands(CLI::App& app, Action& action);
/// Those for devices that no running gateway has: twins, profiles, one look, a bridge.
void AddDeviceCommands(CLI::App& app, Action& action);

/// Whether the first word looks like a subcommand and is none. Then it is said which there are:
/// CLI11 itself only says that a subcommand is required.
bool IsUnknownSubcommand(const CLI::App& app, std::string_view word);

}  // namespace baudgate::tools
