// How long poll(2) may wait.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>
#include <optional>

#include "gateway/base/time.h"

namespace baudgate {

/// Milliseconds; -1 where there is no end.
inline int MillisecondsLeft(std::optional<Instant> until) {
  if (!until) return -1;
  const Duration left = std::max<Duration>(*until - ReadClocks().instant, Duration::zero());
  return static_cast<int>(std::chrono::ceil<std::chrono::milliseconds>(left).count());
}

}  // namespace baudgate
