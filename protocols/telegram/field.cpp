// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/field.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <limits>

#include "gateway/base/decimal.h"
#include "gateway/base/text.h"

namespace baudgate::protocols::telegram {
namespace {

using Kind = Format::Kind;

constexpr std::string_view kDigits = "0123456789";

bool AllDigits(std::string_view text) {
  return !text.empty() && text.find_first_not_of(kDigits) == std::string_view::npos;
}

/// "12.5" or "12", without a sign; as many decimals as the format says.
bool IsPlain(std::string_view text, const Format& format) {
  const std::size_t point = text.find('.');
  const std::string_view whole = text.substr(0, point);
  if (point == std::string_view::npos) {
    return !format.point && format.precision <= 0 && AllDigits(whole);
  }
  const std::string_view behind = text.substr(point + 1);
  if (format.kind == Kind::integer) return false;
  if (whole.empty() && behind.empty()) return false;
  if (!whole.empty() && !AllDigits(whole)) return false;
  if (!behind.empty() && !AllDigits(behind)) return false;
  return format.precision < 0 || behind.size() == static_cast<std::size_t>(format.precision);
}

/// Without the blanks that may stand beside a number: in front of it; in a field of a fixed width
/// behind it instead, where it stands at the left. "5  kg" may be "50 kg" that was damaged. Hex
/// digits of a fixed width, and what is filled with zeros, have none; behind an exponent and a
/// point a blank has taken the place of a digit: "1.25E+0 ", "12. ".
std::string_view WithoutBlanks(const Format& format, std::string_view text) {
  if (format.width > 0 && (format.zeros || format.kind == Kind::hex)) return text;
  if (text.starts_with(' ')) return text.substr(std::min(text.find_first_not_of(' '), text.size()));
  const bool may_end = format.kind == Kind::decimal || format.kind == Kind::integer;
  if (format.width == 0 || !format.left || !may_end) return text;
  const std::string_view number = Trim(text);
  return number.size() < text.size() && number.ends_with('.') ? text : number;
}

/// Sign and digits. Blanks between them fill a field of a fixed width whose sign stands at the
/// left:
/// "+   12.5".
struct SignedText {
  bool negative = false;
  bool has_sign = false;
  std::string_view digits;
};
SignedText TakeSign(const Format& format, std::string_view text) {
  SignedText taken;
  const bool filled = format.width > 0 && !format.zeros && !text.starts_with(' ');
  text = WithoutBlanks(format, text);
  if (!text.empty() && (text.front() == '+' || text.front() == '-')) {
    taken.has_sign = true;
    taken.negative = text.front() == '-';
    text.remove_prefix(1);
    if (filled) text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));
  }
  taken.digits = text;
  return taken;
}

Value WholeValue(bool negative, std::uint64_t magnitude) {
  constexpr auto kMost = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
  if (!negative) {
    if (magnitude <= kMost) return static_cast<std::int64_t>(magnitude);
    return magnitude;
  }
  if (magnitude > kMost) return {};
  return -static_cast<std::int64_t>(magnitude);
}

Value DecodeTextNumber(const Format& format, std::string_view text) {
  if (format.kind == Kind::hex) {
    const std::string_view digits = WithoutBlanks(format, text);
    const auto number = ParseInteger<std::uint64_t>(digits, 16);
    // A sign is a digit of no number.
    if (!number || !HexDigit(digits.front())) return {};
    return WholeValue(false, *number);
  }
  const SignedText parts = TakeSign(format, text);
  if (format.sign && !parts.has_sign) return {};
  std::string_view mantissa = parts.digits;
  std::string_view exponent;
  if (format.kind == Kind::scientific) {
    // What it has lost would change its size by powers of ten.
    const auto e = mantissa.find_first_of("eE");
    if (e == std::string_view::npos) return {};
    exponent = mantissa.substr(e + 1);
    mantissa = mantissa.substr(0, e);
    const bool has_sign = exponent.starts_with('+') || exponent.starts_with('-');
    if (!AllDigits(exponent.substr(has_sign ? 1 : 0)) || exponent.size() > 4) return {};
    if ((format.sign && !has_sign) || mantissa.starts_with('.') || mantissa.ends_with('.')) {
      return {};
    }
  }
  if (!IsPlain(mantissa, format)) return {};
  if (format.kind == Kind::integer) {
    const auto number = ParseInteger<std::uint64_t>(mantissa);
    return number ? WholeValue(parts.negative, *number) : Value{};
  }
  std::string whole = parts.negative ? "-" : "";
  whole += mantissa;
  if (exponent.empty()) {
    const auto number = ParseDecimal(whole);
    // "-0.0" is 0.
    return number ? Value(*number + 0.0) : Value{};
  }
  whole += 'e';
  whole += exponent.starts_with('+') ? exponent.substr(1) : exponent;
  double number = 0;
  const auto [end, error] = std::from_chars(whole.data(), whole.data() + whole.size(), number);
  if (error != std::errc() || end != whole.data() + whole.size() || !std::isfinite(number))
    return {};
  return number;
}

std::uint64_t RawOf(const Format& format, View bytes) {
  std::uint64_t raw = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    raw = raw << 8U | bytes[format.little ? bytes.size() - 1 - i : i];
  }
  return raw;
}

Value DecodeBcd(std::uint64_t raw, std::size_t bytes) {
  std::uint64_t number = 0;
  for (std::size_t digit = 2 * bytes; digit-- > 0;) {
    const std::uint64_t one = raw >> (4 * digit) & 0xFU;
    if (one > 9) return {};
    number = number * 10 + one;
  }
  return WholeValue(false, number);
}

Value DecodeBinary(const Format& format, View bytes) {
  if (bytes.size() != format.width) return {};
  const std::uint64_t raw = RawOf(format, bytes);
  const auto unused = static_cast<unsigned>(64 - 8 * format.width);
  switch (format.kind) {
    case Kind::bcd:
      return DecodeBcd(raw, format.width);
    case Kind::sint:
      return std::bit_cast<std::int64_t>(raw << unused) >> unused;
    case Kind::real: {
      const double number = format.width == 4
                                ? double{std::bit_cast<float>(static_cast<std::uint32_t>(raw))}
                                : std::bit_cast<double>(raw);
      return std::isfinite(number) ? Value(number) : Value{};
    }
    default:
      return WholeValue(false, raw);
  }
}

}  // namespace

std::string ByteText(View bytes) { return bytes.empty() ? "" : "0x" + HexByte(bytes[0]); }

Value DecodeField(const Format& format, View bytes) {
  if (format.is_binary()) return DecodeBinary(format, bytes);
  const std::string_view text = AsText(bytes);
  if (format.is_text_number()) return DecodeTextNumber(format, text);
  if (format.kind == Kind::byte) return ByteText(bytes);
  return std::string(format.kind == Kind::character ? text : Trim(text));
}

bool SameValue(const Value& a, const Value& b) {
  const auto* text = std::get_if<std::string>(&a);
  const auto* other = std::get_if<std::string>(&b);
  if (text != nullptr && other != nullptr) return *text == *other;
  const auto number = [](const Value& value) {
    const auto* written = std::get_if<std::string>(&value);
    return written != nullptr ? Decimal::Parse(*written) : Decimal::Of(value);
  };
  const auto first = number(a);
  return first && first == number(b);
}

}  // namespace baudgate::protocols::telegram
