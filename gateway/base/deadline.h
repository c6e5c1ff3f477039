// Times at which something is due, where one may never be.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <initializer_list>
#include <optional>

#include "gateway/base/time.h"

namespace baudgate {

/// Empty: none of them is ever due.
inline std::optional<Instant> Soonest(std::initializer_list<std::optional<Instant>> times) {
  std::optional<Instant> soonest;
  for (const std::optional<Instant>& time : times) {
    if (time && (!soonest || *time < *soonest)) soonest = time;
  }
  return soonest;
}

inline bool HasCome(const std::optional<Instant>& time, Instant now) {
  return time && *time <= now;
}

}  // namespace baudgate
