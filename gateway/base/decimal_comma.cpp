// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/decimal_comma.h"

namespace baudgate {

std::string WithDecimalPoint(std::string_view text) {
  const auto is_digit = [text](std::size_t at) {
    return at < text.size() && text[at] >= '0' && text[at] <= '9';
  };
  const std::size_t comma = text.find(',');
  if (comma == std::string_view::npos || comma == 0 || !is_digit(comma - 1)) return {};
  if (!is_digit(comma + 1) || text.find_first_of(",.", comma + 1) != std::string_view::npos) {
    return {};
  }
  std::string meant(text);
  meant[comma] = '.';
  return meant;
}

}  // namespace baudgate
