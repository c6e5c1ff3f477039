// Values, ages and foreign text as people see them, in tables and sentences.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "gateway/base/time.h"

namespace baudgate {

/// Whole numbers whole, others with nine digits at most: "1834523", "12.25", "-" for NaN.
std::string FormatValue(double value);
/// "0.3 s", "12 s", "5 min", "3 h", "2 d".
std::string FormatAge(Duration age);
/// "1 line", "2 lines".
std::string Plural(std::uint64_t count, std::string_view word);
/// Control characters but those in `kept`, and what is no UTF-8, become '?'.
std::string Harmless(std::string_view text, std::string_view kept = {});

}  // namespace baudgate
