// Numbers with a decimal comma, as many people write them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace baudgate {

/// The character there is a comma between two digits.
bool IsDecimalComma(std::string_view text, std::size_t at);

/// "1,5s" → "1.5s"; empty: its comma, if it has one, does not stand alone between two digits.
std::string WithDecimalPoint(std::string_view text);

}  // namespace baudgate
