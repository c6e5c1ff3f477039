// Whether the points that a write depends on have the required values (allow_when). A point that is
// bad, uncertain or was never read refuses the write.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "config/model/point.h"
#include "gateway/base/time.h"
#include "gateway/bus/points/point_store.h"

namespace baudgate {

/// Why `value` may not be written, in one sentence; empty: it may be.
std::optional<std::string> WhyLocked(const PointStore& store, const config::Point& point,
                                     const Value& value, Instant now);

/// Why a limit that is another point of the device (`max: NAME`) forbids the value.
struct Beyond {
  bool known = true;  ///< false: the limit is not
  std::string text;   ///< one sentence
};
std::optional<Beyond> WhyBeyond(const PointStore& store, std::uint32_t device,
                                const config::Point& point, const Value& value, Instant now);

/// The point has such a limit, or an interlock: it is looked at again before each request.
bool IsGuarded(const config::Point& point);

}  // namespace baudgate
