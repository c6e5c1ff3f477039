// Numbers that not everybody reads alike: 010 is 10 to some readers of YAML, and 8 to others.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "gateway/base/result.h"

namespace baudgate {

/// Why a number with a leading zero is not taken; empty: it has none. A sign may stand before its
/// digits, and a fraction or a unit behind them: "-010", "00.5", "05s". Goes on behind the number:
/// "has a leading zero: it is 10 in YAML 1.2, and 8 in YAML 1.1; write 10 or 8".
std::string WhyLeadingZero(std::string_view number);

/// The same of all numbers in `text` that stand directly behind one of these characters; '^' is the
/// begin of the text, and a 'b' counts where a bit is named: "[b03]", "[b0-b03]". The error names
/// the number.
Status RefuseLeadingZeros(std::string_view text, std::string_view behind);

}  // namespace baudgate
