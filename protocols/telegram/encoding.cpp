// Encodes values as the bytes of a field. A value that the format cannot express is refused,
// because the device would otherwise get another value.
#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <limits>

#include "gateway/base/decimal.h"
#include "gateway/base/text.h"
#include "protocols/telegram/field.h"

namespace baudgate::protocols::telegram {
namespace {

using Kind = Format::Kind;

Bytes OfRaw(const Format& format, std::uint64_t raw) {
  Bytes bytes(format.width);
  for (std::size_t i = 0; i < bytes.size(); ++i, raw >>= 8U) {
    bytes[format.little ? i : bytes.size() - 1 - i] = static_cast<std::uint8_t>(raw);
  }
  return bytes;
}

Error DoesNotFit(const Value& value, const std::string& why) {
  return {"the value " + ToText(value) + " " + why};
}

/// Returns `text` padded to the width of the field: numbers with blanks in front, texts with blanks
/// behind. Hex digits, and numbers whose format has zeros or a sign, get zeros in front.
Result<Bytes> Padded(const Format& format, std::string text, const Value& value) {
  if (format.width == 0) return ToBytes(text);
  const std::size_t width = format.width;
  if (text.size() > width) {
    return DoesNotFit(value, "needs " + std::to_string(text.size()) +
                                 " characters, but the field has " + std::to_string(width));
  }
  const std::size_t missing = width - text.size();
  if (!format.is_text_number()) {
    text.append(missing, ' ');
  } else if (format.zeros || format.sign || format.kind == Kind::hex) {
    const bool has_sign = text.starts_with('+') || text.starts_with('-');
    text.insert(has_sign ? 1 : 0, missing, '0');
  } else {
    text.insert(0, missing, ' ');
  }
  return ToBytes(text);
}

/// True if both numbers are equal except for rounding errors of doubles. Example: 0.3 and
/// 0.30000000000000004.
bool IsSame(const Decimal& a, const Decimal& b) {
  static const Decimal kSlack = Decimal(1).Shifted(-14);
  return Abs(a - b) <= Abs(a) * kSlack;
}

std::optional<Decimal> RoundedTo(const Decimal& number, int places) {
  const auto scaled = Abs(number).Shifted(places).ToUint64();
  if (!scaled) return std::nullopt;
  const Decimal rounded = Decimal(*scaled).Shifted(-places);
  return number.is_negative() ? -rounded : rounded;
}

/// Returns the number of decimals to write. Empty: as many as the number needs.
std::optional<int> PlacesOf(const Format& format, const Decimal& number) {
  if (format.kind != Kind::decimal) return 0;
  if (format.precision >= 0) return format.precision;
  if (!format.point) return std::nullopt;
  // The decimals fill the width of the field. Example: 7.331 becomes "+07.331".
  const auto whole = Abs(number).ToUint64();
  const std::size_t before = whole ? std::to_string(*whole).size() : 20;
  const std::size_t used = before + 1 + (format.sign || number.is_negative() ? 1 : 0);
  if (format.width > used) return static_cast<int>(std::min<std::size_t>(format.width - used, 9));
  if (format.width > 0) return 1;
  // Without a width, the text has as many decimals as needed, at least one, as in "12.0".
  const std::string text = Abs(number).ToText();
  const auto point = text.find('.');
  return point == std::string::npos
             ? 1
             : static_cast<int>(std::min<std::size_t>(text.size() - point - 1, 18));
}

/// Returns a number as a text such as "12.500", without a sign.
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
  std::string digits;
  if (const auto places = PlacesOf(format, number)) {
    const auto rounded = RoundedTo(number, *places);
    if (!rounded) return DoesNotFit(value, "is too large");
    if (!IsSame(number, *rounded)) {
      return DoesNotFit(value, "has more decimals than the field, which has " +
                                   std::to_string(*places) +
                                   "; write fewer decimals, because no value is rounded");
    }
    digits = FixedText(number, *places).value_or("0");
  } else {
    digits = Abs(number).ToText();
    if (digits.find('e') != std::string::npos)
      return DoesNotFit(value, "is too large or too small");
  }
  const bool zero = digits.find_first_of("123456789") == std::string::npos;
  const bool negative = number.is_negative() && !zero;
  return Padded(format, (negative ? "-" : format.sign ? "+" : "") + digits, value);
}

/// Returns a number as a text such as "1.25e+01". If the format has no precision, the text has as
/// many digits as the number needs.
std::string ScientificText(const Format& format, double number) {
  std::array<char, 48> buffer{};
  const auto [end, error] =
      format.precision < 0 ? std::to_chars(buffer.data(), buffer.data() + buffer.size(), number,
                                           std::chars_format::scientific)
                           : std::to_chars(buffer.data(), buffer.data() + buffer.size(), number,
                                           std::chars_format::scientific, format.precision);
  std::string text(buffer.data(), error == std::errc() ? end : buffer.data());
  if (format.point && text.find('.') == std::string::npos) {
    text.insert(std::min(text.find('e'), text.size()), ".0");
  }
  return text;
}

double ReadScientific(const std::string& text) {
  double number = 0;
  std::from_chars(text.data(), text.data() + text.size(), number);
  return number;
}

Result<Bytes> EncodeScientific(const Format& format, double number, const Value& value) {
  std::string text = ScientificText(format, number);
  if (!IsSame(Decimal(number), Decimal(ReadScientific(text)))) {
    return DoesNotFit(
        value, "has more digits than the field; write fewer digits, because no value is rounded");
  }
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
  if (!number.is_whole())
    return DoesNotFit(value,
                      "is not a whole number; write a whole number, because no value is rounded");
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

/// Encodes a float. A fraction becomes the nearest float; a whole number that a float cannot
/// represent exactly is refused.
Result<Bytes> EncodeReal(const Format& format, const Decimal& number, const Value& value) {
  const double real = number.ToDouble();
  const bool single = format.width == 4;
  if (single && std::abs(real) > std::numeric_limits<float>::max()) {
    return DoesNotFit(value, "is out of the field's range");
  }
  const double held = single ? double{static_cast<float>(real)} : real;
  if (number.is_whole() && Decimal(held) != number) {
    return DoesNotFit(
        value,
        "has more digits than a float can hold; write fewer digits, because no value is rounded");
  }
  if (!single) return OfRaw(format, std::bit_cast<std::uint64_t>(real));
  return OfRaw(format, std::bit_cast<std::uint32_t>(static_cast<float>(real)));
}

std::optional<Decimal> NumberOf(const Value& value) {
  const auto* text = std::get_if<std::string>(&value);
  return text != nullptr ? Decimal::Parse(*text) : Decimal::Of(value);
}

Result<Bytes> EncodeNumber(const Format& format, const Value& value) {
  const auto number = NumberOf(value);
  if (!number) return Error{"'" + Printable(ToBytes(ToText(value))) + "' is not a number"};
  switch (format.kind) {
    case Kind::decimal:
    case Kind::integer:
      return EncodeDecimal(format, *number, value);
    case Kind::scientific:
      return EncodeScientific(format, number->ToDouble(), value);
    case Kind::real:
      return EncodeReal(format, *number, value);
    default:
      return EncodeWhole(format, *number, value);
  }
}

/// Returns a simulated number with as few digits as a device would show.
Decimal Shown(const Decimal& number) {
  constexpr std::size_t kMostDigits = 9;
  const std::string text = Abs(number).ToText();
  const auto first = text.find_first_of("123456789");
  if (first == std::string::npos || text.size() - first <= kMostDigits + 1) return number;
  if (Abs(number) >= 1) return RoundedTo(number, 3).value_or(number);
  return RoundedTo(number, static_cast<int>(first) + 4).value_or(number);
}

}  // namespace

Result<Bytes> EncodeField(const Format& format, const Value& value) {
  if (format.kind == Kind::bytes) return BlankField(format);
  if (format.is_number()) return EncodeNumber(format, value);
  std::string text = ToText(value);
  if (format.kind == Kind::byte) {
    const auto byte = text.starts_with("0x") ? ParseHex(text.substr(2)) : std::nullopt;
    if (byte && byte->size() == 1 && ByteText(*byte) == text) return *byte;
    return Error{"write a byte as 0x1A, with two hex digits"};
  }
  if (!std::ranges::all_of(ToBytes(text), IsPrintable)) {
    return Error{"the text contains a character that is not printable ASCII, so it is not sent"};
  }
  if (format.kind == Kind::word && (text.empty() || text.find(' ') != std::string::npos)) {
    return Error{"a word needs at least one character and no blanks"};
  }
  if (format.kind == Kind::character && text.size() != 1) {
    return Error{"this field takes one character, not " + std::to_string(text.size())};
  }
  return Padded(format, std::move(text), value);
}

Value Nearest(const Format& format, const Value& value) {
  auto number = format.is_number() ? NumberOf(value) : std::nullopt;
  if (!number) return value;
  if (format.kind == Kind::scientific) {
    return format.precision < 0 ? Value(Shown(*number).ToDouble())
                                : Value(ReadScientific(ScientificText(format, number->ToDouble())));
  }
  if (format.kind == Kind::real) return value;
  const auto places = PlacesOf(format, *number);
  if (!places) return Shown(*number).ToValue();
  const auto rounded = RoundedTo(*number, *places);
  return rounded ? rounded->ToValue() : value;
}

Bytes BlankField(const Format& format) {
  const std::size_t width = format.width;
  if (format.is_text()) return Bytes(width == 0 ? 1 : width, ' ');
  return Bytes(width, 0);
}

}  // namespace baudgate::protocols::telegram
