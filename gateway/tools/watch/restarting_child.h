// `RunGuarded` runs code that a hostile datagram can crash (the DDS library) in a child process.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <ostream>
#include <span>

#include "gateway/base/time.h"

namespace baudgate::tools {

/// Returns the exit code of `run`, or 128 plus the number of the signal that killed the child.
/// After a kill, writes a line to `err` and starts another child after a pause: those of `ladder`
/// in turn, then the last again and again. SIGINT, SIGTERM and SIGHUP are passed to the child,
/// which is then not started again; during a pause they end the function with 0. Must be called
/// before other threads are started.
int RunGuarded(const std::function<int()>& run, std::span<const Duration> ladder,
               std::ostream& err);

}  // namespace baudgate::tools
