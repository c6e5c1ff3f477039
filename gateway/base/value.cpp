// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/value.h"

#include <limits>
#include <type_traits>

#include "gateway/base/text.h"

namespace baudgate {

double ToDouble(const Value& value) {
  return std::visit(
      [](const auto& held) -> double {
        using T = std::decay_t<decltype(held)>;
        if constexpr (std::is_arithmetic_v<T>) {
          return static_cast<double>(held);
        } else {
          return std::numeric_limits<double>::quiet_NaN();
        }
      },
      value);
}

std::string ToText(const Value& value) {
  return std::visit(
      [](const auto& held) -> std::string {
        using T = std::decay_t<decltype(held)>;
        if constexpr (std::is_same_v<T, std::monostate>) {
          return {};
        } else if constexpr (std::is_same_v<T, bool>) {
          return held ? "true" : "false";
        } else if constexpr (std::is_same_v<T, double>) {
          return FormatNumber(held);
        } else if constexpr (std::is_same_v<T, std::string>) {
          return held;
        } else {
          return std::to_string(held);
        }
      },
      value);
}

}  // namespace baudgate
