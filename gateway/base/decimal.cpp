// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/decimal.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>

#include "gateway/base/text.h"

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

namespace {

__extension__ using Digits = unsigned __int128;

constexpr Digits kMostDigits = ~Digits{0};
constexpr std::uint64_t kMost64 = std::numeric_limits<std::uint64_t>::max();
/// The exponent of a double, and of a number that Parse accepts, is never larger than this.
constexpr int kMostPlaces = 400;

}  // namespace

struct Decimal::Wide {
  bool is_negative = false;
  int exponent = 0;
  Digits digits = 0;

  /// Appends zeros until the exponent is `wanted`, as long as the digits fit into 128 bits.
  void LowerTo(int wanted) {
    while (exponent > wanted && digits <= kMostDigits / 10) {
      digits *= 10;
      --exponent;
    }
  }
  void DropDigit(bool round) {
    const auto last = static_cast<unsigned>(digits % 10);
    digits = digits / 10 + (round && last >= 5 ? 1 : 0);
    ++exponent;
  }
  void RaiseTo(int wanted) {
    while (exponent < wanted && digits > 0) DropDigit(exponent + 1 == wanted);
    exponent = std::max(exponent, wanted);
  }
};

Decimal Decimal::Of(Wide wide) {
  while (wide.digits > kMost64) wide.DropDigit(wide.digits / 10 <= kMost64);
  while (wide.digits != 0 && wide.digits % 10 == 0) wide.DropDigit(false);
  Decimal number;
  if (wide.digits == 0) return number;
  number.is_negative_ = wide.is_negative;
  number.exponent_ = wide.exponent;
  number.digits_ = static_cast<std::uint64_t>(wide.digits);
  return number;
}

Decimal::Wide Decimal::Widened() const { return {is_negative_, exponent_, digits_}; }

Decimal::Decimal(double number) {
  std::array<char, 32> text{};
  const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), std::abs(number),
                                          std::chars_format::scientific);
  const std::string_view all(text.data(), error == std::errc() ? end : text.data());
  const auto e = all.find('e');
  if (e == std::string_view::npos) return;  // NaN or infinity: the number stays 0
  Wide wide{.is_negative = std::signbit(number)};
  for (const char c : all.substr(0, e)) {
    if (c == '.') continue;
    wide.digits = wide.digits * 10 + static_cast<unsigned>(c - '0');
    --wide.exponent;
  }
  const std::string_view power = all.substr(all[e + 1] == '+' ? e + 2 : e + 1);
  wide.exponent += ParseInteger<int>(power).value_or(0) + 1;
  *this = Of(wide);
}

std::optional<Decimal> Decimal::Parse(std::string_view text) {
  if (text.starts_with("0x") || text.starts_with("0X")) {
    const auto number = ParseInteger<std::uint64_t>(text.substr(2), 16);
    return number ? std::optional(Decimal(*number)) : std::nullopt;
  }
  if (const auto e = text.find_first_of("eE"); e != std::string_view::npos) {
    const auto mantissa = Parse(text.substr(0, e));
    const bool plus = text.substr(e + 1).starts_with('+');
    const auto power = ParseInteger<int>(text.substr(e + (plus ? 2 : 1)));
    if (!mantissa || !power || (plus && *power < 0) || std::abs(*power) > kMostPlaces) {
      return std::nullopt;
    }
    const Decimal number = mantissa->Shifted(*power);
    return std::isfinite(number.ToDouble()) ? std::optional(number) : std::nullopt;
  }
  const auto near = ParseDecimal(text);
  if (!near || !std::isfinite(*near)) return std::nullopt;
  Wide wide{.is_negative = text.front() == '-'};
  bool behind_point = false;
  for (const char c : text) {
    if (c == '.') behind_point = true;
    if (c < '0' || c > '9') continue;
    if (wide.digits > kMostDigits / 10 - 1) {
      wide.exponent += behind_point ? 0 : 1;
      continue;
    }
    wide.digits = wide.digits * 10 + static_cast<unsigned>(c - '0');
    wide.exponent -= behind_point ? 1 : 0;
  }
  return Of(wide);
}

std::optional<Decimal> Decimal::Of(const Value& value) {
  return std::visit(
      [](const auto& held) -> std::optional<Decimal> {
        using T = std::decay_t<decltype(held)>;
        if constexpr (std::is_same_v<T, double>) {
          return std::isfinite(held) ? std::optional(Decimal(held)) : std::nullopt;
        } else if constexpr (std::is_arithmetic_v<T>) {
          return Decimal(held);
        } else {
          return std::nullopt;
        }
      },
      value);
}

double Decimal::ToDouble() const {
  const std::string text = std::to_string(digits_) + "e" + std::to_string(exponent_);
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc()) {
    number = exponent_ > 0 ? std::numeric_limits<double>::infinity() : 0;
  }
  return is_negative_ ? -number : number;
}

std::string Decimal::ToText() const {
  const std::string sign = is_negative_ ? "-" : "";
  std::string text = std::to_string(digits_);
  const int size = static_cast<int>(text.size());
  // The number of digits in front of the point. Zero or less: the number begins with "0.0".
  const int point = size + exponent_;
  if (point > 21 || point < -5) return sign + text + "e" + std::to_string(exponent_);
  if (exponent_ >= 0) return sign + text.append(static_cast<std::size_t>(exponent_), '0');
  if (point > 0) return sign + text.insert(static_cast<std::size_t>(point), ".");
  return sign + "0." + std::string(static_cast<std::size_t>(-point), '0') + text;
}

std::optional<std::uint64_t> Decimal::ToUint64() const {
  Wide wide = Widened();
  wide.LowerTo(0);
  wide.RaiseTo(0);
  const bool fits = wide.exponent == 0 && wide.digits <= kMost64;
  if (!fits || (is_negative_ && wide.digits != 0)) return std::nullopt;
  return static_cast<std::uint64_t>(wide.digits);
}

std::optional<std::int64_t> Decimal::ToInt64() const {
  constexpr auto kMost = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
  const auto size = Abs(*this).ToUint64();
  if (!size || *size > kMost + (is_negative_ ? 1 : 0)) return std::nullopt;
  return static_cast<std::int64_t>(is_negative_ ? ~*size + 1 : *size);
}

Value Decimal::ToValue() const {
  if (is_whole()) {
    if (const auto whole = ToInt64()) return *whole;
    if (const auto whole = ToUint64()) return *whole;
  }
  return ToDouble();
}

bool Decimal::is_whole() const { return exponent_ >= 0; }

bool Decimal::IsMultipleOf(const Decimal& step) const {
  if (digits_ == 0 || step.digits_ == 0) return digits_ == 0;
  // If this number has more decimal places than `step`, it is no multiple. Otherwise it is scaled
  // to the exponent of `step`. Only remainders are computed, so no product overflows.
  if (exponent_ < step.exponent_) return false;
  Digits rest = digits_ % step.digits_;
  for (int i = step.exponent_; i < exponent_ && rest != 0; ++i) rest = rest * 10 % step.digits_;
  return rest == 0;
}

Decimal Decimal::Shifted(int places) const {
  Decimal number = *this;
  if (digits_ != 0) number.exponent_ += places;
  return number;
}

bool Decimal::IsRounded(const Decimal& exact) const {
  return Abs(exact - *this) <= Decimal(5).Shifted(exponent_ - 1);
}

Decimal Decimal::operator-() const {
  Decimal number = *this;
  number.is_negative_ = digits_ != 0 && !is_negative_;
  return number;
}

Decimal operator*(const Decimal& a, const Decimal& b) {
  return Decimal::Of(
      {a.is_negative_ != b.is_negative_, a.exponent_ + b.exponent_, Digits{a.digits_} * b.digits_});
}

Decimal operator/(const Decimal& a, const Decimal& b) {
  Decimal::Wide wide = a.Widened();
  wide.is_negative = a.is_negative_ != b.is_negative_;
  wide.LowerTo(-kMostPlaces);
  wide.exponent -= b.exponent_;
  const bool up = wide.digits % b.digits_ > b.digits_ / 2;
  wide.digits = wide.digits / b.digits_ + (up ? 1 : 0);
  return Decimal::Of(wide);
}

Decimal operator+(const Decimal& a, const Decimal& b) {
  if (a.digits_ == 0 || b.digits_ == 0) return a.digits_ == 0 ? b : a;
  Decimal::Wide more = a.Widened();
  Decimal::Wide less = b.Widened();
  if (more.exponent < less.exponent) std::swap(more, less);
  more.LowerTo(less.exponent);
  less.RaiseTo(more.exponent);
  if (more.is_negative == less.is_negative) {
    if (more.digits > kMostDigits - less.digits) {
      more.DropDigit(true);
      less.DropDigit(true);
    }
    more.digits += less.digits;
  } else if (more.digits >= less.digits) {
    more.digits -= less.digits;
  } else {
    more.digits = less.digits - more.digits;
    more.is_negative = less.is_negative;
  }
  return Decimal::Of(more);
}

std::strong_ordering operator<=>(const Decimal& a, const Decimal& b) {
  const Decimal difference = a - b;
  if (difference.digits_ == 0) return std::strong_ordering::equal;
  return difference.is_negative_ ? std::strong_ordering::less : std::strong_ordering::greater;
}

double AsDecimal(double number) {
  constexpr int kDigits = std::numeric_limits<float>::max_digits10;
  std::array<char, 32> text{};
  const auto read = [&](char* end) {
    double value = number;
    std::from_chars(text.data(), end, value);
    return value;
  };
  char* const last = text.data() + text.size();
  const bool is_short =
      read(std::to_chars(text.data(), last, number, std::chars_format::general, kDigits).ptr) ==
      number;
  if (is_short || std::abs(number) > std::numeric_limits<float>::max()) return number;
  const auto single = static_cast<float>(number);
  if (static_cast<double>(single) != number) return number;
  const double shown = read(std::to_chars(text.data(), last, single).ptr);
  // The largest float32 is printed as 3.4028235e38, which is above the range of float32, so it is
  // returned unchanged.
  return std::abs(shown) > std::numeric_limits<float>::max() ? number : shown;
}

double NearestSingle(double number) {
  // Numbers from kEnd on are nearer to 2^128, which is not a float32, than to the largest float32.
  constexpr double kEnd = 0x1.FFFFFFp127;
  if (!(std::abs(number) < kEnd)) return std::copysign(HUGE_VAL, number);
  return AsDecimal(static_cast<double>(static_cast<float>(number)));
}

bool IsMeant(const Value& said, const Decimal& written) {
  const auto* const real = std::get_if<double>(&said);
  if (real == nullptr) return Decimal::Of(said) == written;
  const double meant = written.ToDouble();
  if (meant == *real) return true;
  const double shown = AsDecimal(*real);
  return NearestSingle(*real) == shown && NearestSingle(meant) == shown &&
         written.IsRounded(Decimal(*real));
}

}  // namespace baudgate
