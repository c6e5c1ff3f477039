// Numbers that not everybody reads alike: 010 is 10 to some readers of YAML, and 8 to others.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "gateway/base/result.h"

namespace baudgate {

/// Why `number` is refused for its leading zero; empty: it has no leading zero. A sign may stand
/// before the digits, and a fraction or a unit behind them: "-010", "00.5", "05s". The caller puts
/// the number in front of the text: "010 " + "has a leading zero: it is 10 in YAML 1.2, and 8 in
/// YAML 1.1; write 10 or 8".
std::string WhyLeadingZero(std::string_view number);

/// Refuses a leading zero of every number in `text` that stands directly behind one of the
/// characters `behind`, where '^' means the begin of the text. Numbers of bits are always checked:
/// "[b03]", "[b0-b03]". The error names the number.
Status RefuseLeadingZeros(std::string_view text, std::string_view behind);

}  // namespace baudgate
