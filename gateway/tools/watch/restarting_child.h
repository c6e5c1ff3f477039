// `RunGuarded` runs code that a hostile datagram can crash (the DDS library) in a child process,
// and starts it again after a crash. Used by `watch`; the publishing side uses
// gateway/outputs/dds/link instead.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <ostream>
#include <span>

#include "gateway/base/time.h"

namespace baudgate::tools {

/// Calls `run` in a child process, which ends with this process. Returns the exit code of `run`, or
/// 128 plus the number of the signal that killed the child. If a signal other than SIGPIPE kills
/// the child, writes a line to `err` and starts another child after a pause: the pauses of `ladder`
/// in turn, then its last one again and again. SIGINT, SIGTERM and SIGHUP are passed to the child,
/// which is then not started again; during a pause they end the function with 0. Must be called
/// before other threads are started.
int RunGuarded(const std::function<int()>& run, std::span<const Duration> ladder,
               std::ostream& err);

}  // namespace baudgate::tools
