// The subcommands for devices that no running gateway has: twins, profiles, one look, a bridge.
// Part of commands.h. AddBusCommands adds `scan` and `ask`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/tools/cli/commands.h"

namespace baudgate {

// The words and help of `scan` and `ask`: subcommands about a bus.

void AddBusCommands(CLI::App& app, Action& action);

void AddDeviceCommands(CLI::App& app, Action& action);

}  // namespace baudgate
