// One value of a point, as read, stored, served and written.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <variant>

namespace baudgate {

/// Nothing yet, or a value. Integers of every width travel as 64 bits; unsigned 64-bit counters
/// keep their own alternative because they do not fit.
using Value = std::variant<std::monostate, bool, std::int64_t, std::uint64_t, double, std::string>;

inline bool HasValue(const Value& value) { return value.index() != 0; }

/// As a number: booleans are 0 and 1; text and nothing are NaN.
double ToDouble(const Value& value);

/// As people read it: "0.52", "true", "SPCJ 4D29", "" for nothing.
std::string ToText(const Value& value);

}  // namespace baudgate
