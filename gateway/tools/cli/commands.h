// The subcommands of baudgate: their words and help, and which function of gateway/tools/cli does
// each. Words come from gateway/main.cpp; what is to be done goes back to it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string_view>

#include "config/catalog/catalog.h"

namespace baudgate {

/// What the chosen subcommand does, once all words are parsed; returns the exit code.
using Action = std::function<int(const config::Catalog&)>;

/// Each subcommand sets `action` when it is the one that is parsed; both outlive the parsing.
void AddCommands(CLI::App& app, Action& action);

/// Whether the first word looks like a subcommand and is none. Then it is said which there are:
/// CLI11 itself only says that a subcommand is required.
bool IsUnknownSubcommand(const CLI::App& app, std::string_view word);

}  // namespace baudgate
