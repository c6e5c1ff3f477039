// A value as people write it, for one point: "0.52", "on", "12". Used by the command line's writes.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "config/model/point.h"
#include "gateway/base/result.h"
#include "gateway/base/value.h"

namespace baudgate {

/// bool: true, false, on, off, 1, 0. Whole numbers exactly. The error says which texts are valid.
Result<Value> ParseValue(const config::Point& point, std::string_view text);

}  // namespace baudgate
