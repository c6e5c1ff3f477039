// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/leading_zero.h"

#include <algorithm>
#include <cstdint>

#include "gateway/base/text.h"

namespace baudgate {
namespace {

constexpr std::string_view kDigits = "0123456789";

bool IsDigit(char c) { return kDigits.find(c) != std::string_view::npos; }

}  // namespace

std::string WhyLeadingZero(std::string_view number) {
  const bool has_sign = number.starts_with('-') || number.starts_with('+');
  const std::string sign(number.substr(0, has_sign && number.front() == '-' ? 1 : 0));
  if (has_sign) number.remove_prefix(1);
  if (number.size() < 2 || number[0] != '0' || !IsDigit(number[1])) return {};
  const std::size_t end = std::min(number.find_first_not_of(kDigits), number.size());
  const std::size_t first = std::min(number.find_first_not_of('0'), end - 1);
  const std::string without = sign + std::string(number.substr(first));
  const auto octal = ParseInteger<std::uint64_t>(number.substr(0, end), 8);
  if (end < number.size() || !octal || std::to_string(*octal) == number.substr(first)) {
    return "has a leading zero; write " + without;
  }
  const std::string as_octal = sign + std::to_string(*octal);
  return "has a leading zero: it is " + without + " in YAML 1.2, and " + as_octal +
         " in YAML 1.1; write " + without + " or " + as_octal;
}

Status RefuseLeadingZeros(std::string_view text, std::string_view behind) {
  for (std::size_t at = text.find_first_of(kDigits); at != std::string_view::npos;) {
    const std::size_t end = std::min(text.find_first_not_of(kDigits, at), text.size());
    const char before = at == 0 ? '^' : text[at - 1];
    const bool of_bit = before == 'b' && at > 1 && (text[at - 2] == '[' || text[at - 2] == '-');
    if (of_bit || behind.find(before) != std::string_view::npos) {
      const std::string number(text.substr(at, end - at));
      const std::string why = WhyLeadingZero(number);
      if (!why.empty()) {
        return Error{"'" + std::string(text) + "': " + number + " " + why};
      }
    }
    at = text.find_first_of(kDigits, end);
  }
  return {};
}

}  // namespace baudgate
