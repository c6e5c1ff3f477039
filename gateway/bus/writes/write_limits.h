// Whether a value may be written to a point: min, max, step and decimals of config::Writing, and
// whether the device can represent it. Pure.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "config/model/point.h"
#include "gateway/base/value.h"

namespace baudgate {

/// "50 Hz".
std::string WithUnit(const config::Point& point, const Decimal& number);

/// The decimal number that a client meant: 30.3 for the float32 30.299999237. Others as they are.
Value AsMeant(const config::Point& point, const Value& value);

/// Why not, in one sentence; empty: it may be. `value` as AsMeant gives it.
std::optional<std::string> WhyOutside(const config::Point& point, const Value& value);

/// Why the device cannot represent exactly this value, in one sentence: scale and type have no raw
/// value for it, the raw value is a sentinel, or it has more digits than `decimals`; empty: it can.
/// `raw`: what ToRaw makes of `value`.
std::optional<std::string> WhyInexact(const config::Point& point, const Value& value,
                                      const Value& raw);

}  // namespace baudgate
