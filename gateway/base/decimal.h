// A decimal number as people write it: 0.57 is 57 hundredths, and 0.57 times 400 is 228, where the
// nearest doubles give 227.99999999999997. Whole numbers of 64 bits are exact. WithDecimalPoint
// accepts a decimal comma, and WhyLeadingZero explains numbers that not everybody reads alike.
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

// Numbers with a decimal comma, as many people write them.

/// The character there is a comma between two digits.
bool IsDecimalComma(std::string_view text, std::size_t at);

/// "1,5s" → "1.5s"; empty: its comma, if it has one, does not stand alone between two digits.
std::string WithDecimalPoint(std::string_view text);

// Numbers that not everybody reads alike: 010 is 10 to some readers of YAML, and 8 to others.

/// Why `number` is refused for its leading zero; empty: it has no leading zero. A sign may stand
/// before the digits, and a fraction or a unit behind them: "-010", "00.5", "05s". The caller puts
/// the number in front of the text: "010 " + "has a leading zero: it is 10 in YAML 1.2, and 8 in
/// YAML 1.1; write 10 or 8".
std::string WhyLeadingZero(std::string_view number);

/// Refuses a leading zero of every number in `text` that stands directly behind one of the
/// characters `behind`, where '^' means the begin of the text. Numbers of bits are always checked:
/// "[b03]", "[b0-b03]". The error names the number.
Status RefuseLeadingZeros(std::string_view text, std::string_view behind);

/// Sums and products are exact where 64 bits hold their digits; else they are rounded to 19 digits,
/// two more than a double has.
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
  /// The shortest decimal that reads back as this double. It has to be finite.
  Decimal(double number);

  /// "-12.50", "+7", "1e30"; in hex, "0xFFFF", a whole number without a sign.
  static std::optional<Decimal> Parse(std::string_view text);
  /// Nothing for texts, NaN, infinity and no value. Booleans are 0 and 1.
  static std::optional<Decimal> Of(const Value& value);

  /// The nearest one.
  double ToDouble() const;
  /// "12.5", with all digits; from 1e-6 to 1e21 without an exponent.
  std::string ToText() const;
  /// As a point of any type of numbers holds it: a whole number, else a double.
  Value ToValue() const;
  /// Halves away from 0. Nothing beyond 64 bits.
  std::optional<std::int64_t> ToInt64() const;
  std::optional<std::uint64_t> ToUint64() const;

  bool is_negative() const { return is_negative_; }
  bool is_whole() const;
  /// A step of 0 has only 0.
  bool IsMultipleOf(const Decimal& step) const;
  /// times 10 to the power of `places`
  Decimal Shifted(int places) const;

  friend Decimal operator*(const Decimal& a, const Decimal& b);
  friend Decimal operator+(const Decimal& a, const Decimal& b);
  /// `b` is not 0.
  friend Decimal operator/(const Decimal& a, const Decimal& b);
  friend Decimal operator-(const Decimal& a, const Decimal& b) { return a + -b; }
  /// Whether `exact`, rounded to the digits that this number has, is this number.
  bool IsRounded(const Decimal& exact) const;
  Decimal operator-() const;
  Decimal& operator*=(const Decimal& other) { return *this = *this * other; }

  friend bool operator==(const Decimal&, const Decimal&) = default;
  friend std::strong_ordering operator<=>(const Decimal& a, const Decimal& b);
  friend std::ostream& operator<<(std::ostream& out, const Decimal& number) {
    return out << number.ToText();
  }

 private:
  struct Wide;  // 128 bits of digits

  static Decimal Of(Wide wide);
  Wide Widened() const;

  // ±digits * 10^exponent; no zero at the end of digits, and 0 is all zeros: equal ones look equal
  bool is_negative_ = false;
  int exponent_ = 0;
  std::uint64_t digits_ = 0;
};

/// The decimal number that a float32 stands for: 30.3 for 30.299999237060547 in 64 bits. A number
/// that is not a float32, or has no more digits than one needs (1834523.25), stays as it is.
double AsDecimal(double number);

/// The float32 that is nearest to `number`, as the decimal number that it stands for: 16777216 for
/// 16777217. Infinite beyond its range.
double NearestSingle(double number);

/// Whether `said`, which a device sends, is the number that a person has written. 999.9 is the
/// float32 999.9000244140625 as well.
bool IsMeant(const Value& said, const Decimal& written);

inline Decimal Abs(const Decimal& number) { return number.is_negative() ? -number : number; }

}  // namespace baudgate
