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

/// Takes sign and blanks off; nothing: two signs, or a blank inside.
struct SignedText {
  bool negative = false;
  bool has_sign = false;
  std::string_view digits;
};
SignedText TakeSign(std::string_view text) {
  SignedText taken;
  text = Trim(text);
  if (!text.empty() && (text.front() == '+' || text.front() == '-')) {
    taken.has_sign = true;
    taken.negative = text.front() == '-';
    text.remove_prefix(1);
    while (text.starts_with(' ')) text.remove_prefix(1);
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
    const std::string_view digits = Trim(text);
    const auto number = ParseInteger<std::uint64_t>(digits, 16);
    // A sign is a digit of no number.
    if (!number || !HexDigit(digits.front())) return {};
    return WholeValue(false, *number);
  }
  const SignedText parts = TakeSign(text);
  if (format.sign && !parts.has_sign) return {};
  std::string_view mantissa = parts.digits;
  std::string_view exponent;
  if (format.kind == Kind::scientific) {
    if (const auto e = mantissa.find_first_of("eE"); e != std::string_view::npos) {
      exponent = mantissa.substr(e + 1);
      mantissa = mantissa.substr(0, e);
      const bool signed_exponent = exponent.starts_with('+') || exponent.starts_with('-');
      if (!AllDigits(exponent.substr(signed_exponent ? 1 : 0)) || exponent.size() > 4) return {};
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

Bytes OfRaw(const Format& format, std::uint64_t raw) {
  Bytes bytes(format.width);
  for (std::size_t i = 0; i < bytes.size(); ++i, raw >>= 8U) {
    bytes[format.little ? i : bytes.size() - 1 - i] = static_cast<std::uint8_t>(raw);
  }
  return bytes;
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

// ---------------------------------------------------------------- to bytes

Error DoesNotFit(const Value& value, const std::string& why) {
  return {"the value " + ToText(value) + " " + why};
}

/// Blanks in front of numbers, behind texts.
Result<Bytes> Padded(const Format& format, std::string text, const Value& value) {
  if (format.width == 0) return ToBytes(text);
  const std::size_t width = format.width;
  if (text.size() > width) {
    return DoesNotFit(value, "needs " + std::to_string(text.size()) +
                                 " characters, and the field has " + std::to_string(width));
  }
  const std::size_t missing = width - text.size();
  if (!format.is_text_number()) {
    text.append(missing, ' ');
  } else if (format.zeros || format.sign) {
    const bool has_sign = text.starts_with('+') || text.starts_with('-');
    text.insert(has_sign ? 1 : 0, missing, '0');
  } else {
    text.insert(0, missing, ' ');
  }
  return ToBytes(text);
}

/// "12.500": rounded to that many decimals.
std::optional<std::string> FixedText(const Decimal& number, int precision) {
  const auto scaled = Abs(number).Shifted(precision).ToUint64();
  if (!scaled) return std::nullopt;
  std::string digits = std::to_string(*scaled);
  const auto places = static_cast<std::size_t>(precision);
  if (digits.size() <= places) digits.insert(0, places + 1 - digits.size(), '0');
  if (places > 0) digits.insert(digits.size() - places, 1, '.');
  return digits;
}

Result<Bytes> EncodeDecimal(const Format& format, const Decimal& number, const Value& value) {
  int precision = format.kind == Kind::integer ? 0 : format.precision;
  std::string digits;
  if (precision < 0 && format.point) {
    // As many as the width has room for, so that "+07.331" comes out of 7.331.
    const auto whole = Abs(number).ToUint64();
    const std::size_t before = whole ? std::to_string(*whole).size() : 20;
    const std::size_t used = before + 1 + (format.sign || number.is_negative() ? 1 : 0);
    precision =
        format.width > used ? static_cast<int>(std::min<std::size_t>(format.width - used, 9)) : 1;
  }
  if (precision >= 0) {
    const auto text = FixedText(number, precision);
    if (!text) return DoesNotFit(value, "is too large");
    digits = *text;
  } else {
    digits = Abs(number).ToText();
    if (digits.find('e') != std::string::npos)
      return DoesNotFit(value, "is too large or too small");
  }
  const bool zero = digits.find_first_of("123456789") == std::string::npos;
  const bool negative = number.is_negative() && !zero;
  return Padded(format, (negative ? "-" : format.sign ? "+" : "") + digits, value);
}

Result<Bytes> EncodeScientific(const Format& format, double number, const Value& value) {
  std::array<char, 48> buffer{};
  const auto [end, error] =
      std::to_chars(buffer.data(), buffer.data() + buffer.size(), number,
                    std::chars_format::scientific, format.precision < 0 ? 6 : format.precision);
  std::string text(buffer.data(), error == std::errc() ? end : buffer.data());
  std::ranges::replace(text, 'e', 'E');
  if (format.sign && !text.starts_with('-')) text.insert(0, 1, '+');
  return Padded(format, text, value);
}

Result<Bytes> EncodeHex(const Format& format, std::uint64_t number, const Value& value) {
  std::array<char, 17> buffer{};
  const auto [end, error] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), number, 16);
  static_cast<void>(error);
  std::string digits(buffer.data(), end);
  if (!format.lower) {
    for (char& c : digits) c = c >= 'a' ? static_cast<char>(c - 'a' + 'A') : c;
  }
  return Padded(format, std::move(digits), value);
}

Result<Bytes> EncodeWhole(const Format& format, const Decimal& number, const Value& value) {
  const auto out_of_range = [&] { return DoesNotFit(value, "is out of the field's range"); };
  const auto bits = static_cast<unsigned>(8 * format.width);
  if (format.kind == Kind::sint) {
    const auto whole = number.ToInt64();
    const std::int64_t most = std::numeric_limits<std::int64_t>::max() >> (64U - bits);
    if (!whole || *whole > most || *whole < -most - 1) return out_of_range();
    return OfRaw(format, static_cast<std::uint64_t>(*whole));
  }
  const auto whole = number.is_negative() ? std::nullopt : number.ToUint64();
  if (!whole) return out_of_range();
  if (format.kind == Kind::hex) return EncodeHex(format, *whole, value);
  if (format.kind == Kind::uint) {
    if (bits < 64 && *whole >> bits != 0) return out_of_range();
    return OfRaw(format, *whole);
  }
  std::uint64_t raw = 0;
  std::uint64_t rest = *whole;
  for (unsigned digit = 0; digit < 2 * format.width; ++digit, rest /= 10) {
    raw |= rest % 10 << (4 * digit);
  }
  if (rest != 0) return out_of_range();
  return OfRaw(format, raw);
}

Result<Bytes> EncodeNumber(const Format& format, const Value& value) {
  auto number = Decimal::Of(value);
  if (const auto* text = std::get_if<std::string>(&value)) number = Decimal::Parse(*text);
  if (!number) return Error{"'" + Printable(ToBytes(ToText(value))) + "' is no number"};
  switch (format.kind) {
    case Kind::decimal:
    case Kind::integer:
      return EncodeDecimal(format, *number, value);
    case Kind::scientific:
      return EncodeScientific(format, number->ToDouble(), value);
    case Kind::real: {
      const double real = number->ToDouble();
      if (format.width == 8) return OfRaw(format, std::bit_cast<std::uint64_t>(real));
      if (std::abs(real) > std::numeric_limits<float>::max()) {
        return DoesNotFit(value, "is out of the field's range");
      }
      return OfRaw(format, std::bit_cast<std::uint32_t>(static_cast<float>(real)));
    }
    default:
      return EncodeWhole(format, *number, value);
  }
}

}  // namespace

Value DecodeField(const Format& format, View bytes) {
  if (format.is_binary()) return DecodeBinary(format, bytes);
  const std::string_view text = AsText(bytes);
  if (format.is_text_number()) return DecodeTextNumber(format, text);
  return std::string(format.kind == Kind::character ? text : Trim(text));
}

Result<Bytes> EncodeField(const Format& format, const Value& value) {
  if (format.kind == Kind::bytes) return BlankField(format);
  if (format.is_number()) return EncodeNumber(format, value);
  std::string text = ToText(value);
  if (!std::ranges::all_of(ToBytes(text), IsPrintable)) {
    return Error{"the text has a character that is no printable ASCII; it is not sent"};
  }
  if (format.kind == Kind::word && (text.empty() || text.find(' ') != std::string::npos)) {
    return Error{"a word has at least one character, and no blank"};
  }
  if (format.kind == Kind::character && text.size() != 1) {
    return Error{"one character is written here, not " + std::to_string(text.size())};
  }
  return Padded(format, std::move(text), value);
}

Bytes BlankField(const Format& format) {
  const std::size_t width = format.width;
  if (format.is_text()) return Bytes(width == 0 ? 1 : width, ' ');
  return Bytes(width, 0);
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
