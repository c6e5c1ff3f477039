// The subcommands of `baudgate config`: their words and help. Part of commands.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/cli/commands.h"

namespace baudgate {

/// `config`, made where it is not there yet.
CLI::App& ConfigCommand(CLI::App& app);

void AddMigrate(CLI::App& app, Action& action);

}  // namespace baudgate
