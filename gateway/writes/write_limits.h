// Whether a number may be written to a point: min, max and step of config::Writing. Pure.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "config/model/point.h"
#include "gateway/base/value.h"

namespace baudgate {

/// The decimal number that a client meant: 30.3 for the float32 30.299999237. Others as they are.
Value AsMeant(const config::Point& point, const Value& value);

/// Why not, in one sentence; empty: it may. `value` as AsMeant gives it.
std::string WhyOutside(const config::Point& point, const Value& value);

}  // namespace baudgate
