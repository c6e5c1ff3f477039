// Runs something that a hostile datagram may end (the DDS library) in a process of its own, and
// starts again when it dies. Used by `watch`; what the gateway publishes has
// gateway/outputs/dds/link.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <ostream>
#include <span>

#include "gateway/base/time.h"

namespace baudgate::tools {

/// Returns the exit code of `run`, which is called in a child process that dies with us. When the
/// child is ended by a signal, a line on `err` says so and another one is started, after the waits
/// in `ladder` one after the other, the last of them again and again. SIGINT, SIGTERM and SIGHUP go
/// to the child, and what ends by them is not started again. Before any other thread.
int RunGuarded(const std::function<int()>& run, std::span<const Duration> ladder,
               std::ostream& err);

}  // namespace baudgate::tools
