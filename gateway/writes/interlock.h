// Whether the points that a write depends on have the required values (allow_when). A point that is
// bad, uncertain or was never read refuses the write.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "config/model/point.h"
#include "gateway/base/time.h"
#include "gateway/store/point_store.h"

namespace baudgate {

/// Why `value` may not be written, in one sentence; empty: it may be.
std::optional<std::string> WhyLocked(const PointStore& store, const config::Point& point,
                                     const Value& value, Instant now);

}  // namespace baudgate
