// The words and help of `scan` and `ask`: subcommands about a bus.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/tools/cli/commands.h"

namespace baudgate {

void AddBusCommands(CLI::App& app, Action& action);

}  // namespace baudgate
