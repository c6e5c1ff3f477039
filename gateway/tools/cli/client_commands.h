// The subcommands that talk to a running gateway: their words and help. Part of commands.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/tools/cli/commands.h"

namespace baudgate {

void AddClientCommands(CLI::App& app, Action& action);

}  // namespace baudgate
