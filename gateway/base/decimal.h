// `Decimal` is a decimal number as people write it: 0.57 is 57 hundredths, and 0.57 times 400 is
// 228, where doubles give 227.99999999999997. Whole numbers of 64 bits are exact. WithDecimalPoint
// accepts a decimal comma, and WhyLeadingZero explains a refused leading zero.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <compare>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <ostream>
#include <string>
#include <string_view>
#include <utility>

#include "gateway/base/result.h"
#include "gateway/base/value.h"

namespace baudgate {

bool IsDecimalComma(std::string_view text, std::size_t at);

/// Replaces a decimal comma by a point: returns "1.5s" for "1,5s". Returns an empty text unless the
/// text has exactly one comma, between two digits.
std::string WithDecimalPoint(std::string_view text);

// A number with a leading zero is ambiguous: 010 is 10 in YAML 1.2, and 8 in YAML 1.1.

/// Returns why `number` is refused for its leading zero; an empty text if it has no leading zero. A
/// sign can stand before the digits, and a fraction or a unit behind them: "-010", "00.5", "05s".
/// The caller puts the number in front of the text: "010 " + "has a leading zero: it is 10 in YAML
/// 1.2, and 8 in YAML 1.1; write 10 or 8".
std::string WhyLeadingZero(std::string_view number);

/// Returns an error if a number in `text` has a leading zero. Only two kinds of numbers are
/// checked: numbers directly after one of the characters in `behind` ('^' stands for the beginning
/// of the text), and bit numbers in brackets ("[b03]", "[b0-b03]"). The error names the number.
Status RefuseLeadingZeros(std::string_view text, std::string_view behind);

/// Sums and products of Decimals are exact if their digits fit into 64 bits; longer results are
/// rounded to 19 digits, two more than a double has.
class Decimal {
 public:
  constexpr Decimal() = default;
  constexpr Decimal(std::integral auto number)
      : is_negative_(std::cmp_less(number, 0)),
        digits_(is_negative_ ? ~static_cast<std::uint64_t>(number) + 1
                             : static_cast<std::uint64_t>(number)) {
    for (; digits_ != 0 && digits_ % 10 == 0; digits_ /= 10) ++exponent_;
  }
  constexpr Decimal(bool number) : digits_(number ? 1 : 0) {}
  /// Takes the shortest decimal number that reads back as `number`, which must be finite.
  Decimal(double number);

  /// Reads "-12.50", "+7", "1e30", or a whole number without a sign in hex: "0xFFFF".
  static std::optional<Decimal> Parse(std::string_view text);
  /// Returns nothing for a text, NaN, infinity and an empty value. A boolean is 0 or 1.
  static std::optional<Decimal> Of(const Value& value);

  double ToDouble() const;
  /// Returns the number with all its digits ("12.5"). Numbers below 1e-6, and from 1e21 on, have an
  /// exponent.
  std::string ToText() const;
  /// Returns an integer if the number is whole and fits into 64 bits, else a double.
  Value ToValue() const;
  /// Rounds halves away from 0. Returns nothing if the result does not fit into 64 bits.
  std::optional<std::int64_t> ToInt64() const;
  std::optional<std::uint64_t> ToUint64() const;

  bool is_negative() const { return is_negative_; }
  bool is_whole() const;
  /// If `step` is 0, only 0 is a multiple.
  bool IsMultipleOf(const Decimal& step) const;
  /// Returns this number times 10 to the power of `places`.
  Decimal Shifted(int places) const;

  friend Decimal operator*(const Decimal& a, const Decimal& b);
  friend Decimal operator+(const Decimal& a, const Decimal& b);
  /// `b` must not be 0.
  friend Decimal operator/(const Decimal& a, const Decimal& b);
  friend Decimal operator-(const Decimal& a, const Decimal& b) { return a + -b; }
  /// True if this number is `exact`, rounded to the last digit of this number: 1.3 for 1.26.
  bool IsRounded(const Decimal& exact) const;
  Decimal operator-() const;
  Decimal& operator*=(const Decimal& other) { return *this = *this * other; }

  friend bool operator==(const Decimal&, const Decimal&) = default;
  friend std::strong_ordering operator<=>(const Decimal& a, const Decimal& b);
  friend std::ostream& operator<<(std::ostream& out, const Decimal& number) {
    return out << number.ToText();
  }

 private:
  struct Wide;  // a number with 128 bits of digits

  static Decimal Of(Wide wide);
  Wide Widened() const;

  // ±digits * 10^exponent. digits_ does not end in a zero, and 0 has all members 0, so equal
  // numbers have equal members.
  bool is_negative_ = false;
  int exponent_ = 0;
  std::uint64_t digits_ = 0;
};

/// Returns the decimal number that a float32 stands for: 30.3 for 30.299999237060547. Returns
/// `number` unchanged if it is not a float32, or has no more than nine digits already (1834523.25).
double AsDecimal(double number);

/// Returns the float32 nearest to `number`, as the decimal number that this float32 stands for.
/// Example: 16777216 for 16777217. Returns infinity for a number beyond the range of float32.
double NearestSingle(double number);

/// True if `said`, a value from a device, equals `written`, a number that a person has entered.
/// Example: the float32 999.9000244140625 equals 999.9.
bool IsMeant(const Value& said, const Decimal& written);

inline Decimal Abs(const Decimal& number) { return number.is_negative() ? -number : number; }

}  // namespace baudgate
