// Characters that were sent at half or twice the bit rate at which they are read, as their bits
// tell. Pure; used by gateway/diagnosis/damage/changed_bytes.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "gateway/base/bytes.h"
#include "gateway/base/finding.h"

namespace baudgate {

/// `connection`: to a serial server, which has the bit rate.
std::optional<Finding> OtherBitRate(View heard, bool connection);

}  // namespace baudgate
