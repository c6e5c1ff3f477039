// Why a server ends connections, as what goes with the ends and what follows them tells it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gateway/base/time.h"
#include "gateway/store/line_status.h"

namespace baudgate::control {

/// Cause and remedy of the ends since then; where nothing stands out, what to look at. `in_use`:
/// the connections had survived longer rests.
std::string WhyEnded(const LineStatus& status, Instant since, bool in_use);

}  // namespace baudgate::control
