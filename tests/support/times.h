// The start time of tests under virtual time.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/base/time.h"

namespace baudgate {

inline constexpr Instant kStart = Instant() + 1h;
inline constexpr WallTime kWall = WallTime(1'790'000'000s);

}  // namespace baudgate
