// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/decimal_comma.h"

namespace baudgate {

bool IsDecimalComma(std::string_view text, std::size_t at) {
  const auto is_digit = [text](std::size_t place) {
    return place < text.size() && text[place] >= '0' && text[place] <= '9';
  };
  return at > 0 && at < text.size() && text[at] == ',' && is_digit(at - 1) && is_digit(at + 1);
}

std::string WithDecimalPoint(std::string_view text) {
  const std::size_t comma = text.find(',');
  if (!IsDecimalComma(text, comma)) return {};
  if (text.find_first_of(",.", comma + 1) != std::string_view::npos) return {};
  std::string meant(text);
  meant[comma] = '.';
  return meant;
}

}  // namespace baudgate
