// The words of `baudgate watch`. Read by baudgate-dds; the gateway's binary passes them on.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>

#include "gateway/tools/watch/watch.h"

namespace baudgate {

/// Adds the subcommand; `options` outlive the parsing.
CLI::App* AddWatch(CLI::App& app, WatchOptions& options);

}  // namespace baudgate
