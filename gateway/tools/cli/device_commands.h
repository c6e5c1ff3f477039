// The subcommands for devices that no running gateway has: twins, profiles, one look, a bridge.
// Part of commands.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/tools/cli/commands.h"

namespace baudgate {

void AddDeviceCommands(CLI::App& app, Action& action);

}  // namespace baudgate
