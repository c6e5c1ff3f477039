// `baudgate status --watch`: the status again and again on the whole screen of a terminal, until it
// is stopped. A gateway that stops is looked for again.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ostream>

#include "gateway/tools/cli/client/status.h"

namespace baudgate {

/// Needs options.terminal. Exit code 0; 2 for an unknown line or device; 4 when no gateway answers
/// at first.
int RunStatusWatch(const StatusOptions& options, std::ostream& out, std::ostream& err);

}  // namespace baudgate
