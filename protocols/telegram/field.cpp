// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/field.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <limits>

#include "gateway/base/decimal.h"
#include "gateway/base/text.h"

namespace baudgate::protocols::telegram {
namespace {

using Kind = Format::Kind;

constexpr std::size_t kWidestField = 255;
constexpr int kMostDecimals = 9;

struct KindWord {
  std::string_view word;
  Kind kind;
};

constexpr std::array<KindWord, 15> kTextWords = {{{"decimal", Kind::decimal},
                                                  {"f", Kind::decimal},
                                                  {"scientific", Kind::scientific},
                                                  {"e", Kind::scientific},
                                                  {"integer", Kind::integer},
                                                  {"d", Kind::integer},
                                                  {"hex", Kind::hex},
                                                  {"X", Kind::hex},
                                                  {"x", Kind::hex},
                                                  {"char", Kind::character},
                                                  {"word", Kind::word},
                                                  {"text", Kind::text},
                                                  {"rest", Kind::text},
                                                  {"bytes", Kind::bytes},
                                                  {"byte", Kind::byte}}};

constexpr std::string_view kAllKinds =
    "decimal, scientific, integer, hex, char, word, text, rest, bytes, byte, uint8 to uint64, int8 "
    "to int64, float32, float64, bcd1 to bcd8";

/// The most common words for binary formats. Error messages suggest them.
constexpr std::array<std::string_view, 12> kBinaryWords = {
    "uint8",    "uint16_be", "uint16_le", "uint32_be", "uint32_le",  "int8",
    "int16_be", "int16_le",  "int32_be",  "int32_le",  "float32_be", "float32_le"};

Result<std::size_t> TakeNumber(std::string_view& text, std::size_t most, std::string_view what) {
  const std::size_t end = std::min(text.find_first_not_of("0123456789"), text.size());
  const auto number = ParseInteger<std::size_t>(text.substr(0, end));
  if (!number || *number > most) {
    return Error{std::string(what) + " " + std::string(text.substr(0, end)) +
                 " is too large; at most " + std::to_string(most)};
  }
  text.remove_prefix(end);
  return *number;
}

/// Parses a binary format: "uint16_le", "int24", "float32_be", "bcd3". Empty: `text` is not such a
/// format.
std::optional<Format> ParseBinary(std::string_view text) {
  Format format;
  format.little = text.ends_with("_le");
  if (format.little || text.ends_with("_be")) text.remove_suffix(3);
  const std::size_t digits = text.find_first_of("0123456789");
  if (digits == std::string_view::npos) return std::nullopt;
  const auto number = ParseInteger<std::size_t>(text.substr(digits));
  const std::string_view word = text.substr(0, digits);
  if (!number || text[digits] == '0') return std::nullopt;
  const bool bcd = word == "bcd";
  if (!bcd && *number % 8 != 0) return std::nullopt;
  format.width = bcd ? *number : *number / 8;
  if (format.width < 1 || format.width > 8) return std::nullopt;
  if (word == "uint") {
    format.kind = Kind::uint;
  } else if (word == "int") {
    format.kind = Kind::sint;
  } else if (bcd) {
    format.kind = Kind::bcd;
  } else if (word == "float" && (format.width == 4 || format.width == 8)) {
    format.kind = Kind::real;
  } else {
    return std::nullopt;
  }
  return format;
}

Error UnknownFormat(std::string_view text) {
  std::vector<std::string_view> words;
  for (const KindWord& one : kTextWords) words.push_back(one.word);
  words.insert(words.end(), kBinaryWords.begin(), kBinaryWords.end());
  return {Quoted(text) + " is not a format;" + DidYouMean(text, words) +
          " formats: " + std::string(kAllKinds)};
}

Status CheckTextFormat(const Format& format, std::string_view text) {
  const bool real = format.kind == Kind::decimal || format.kind == Kind::scientific;
  const auto wrong = [&](const char* why) { return Error{Quoted(text) + ": " + why}; };
  if ((format.precision >= 0 || format.point) && !real) {
    return wrong("only decimal and scientific numbers can have a decimal point");
  }
  if (format.sign && (!format.is_text_number() || format.kind == Kind::hex)) {
    return wrong("only numbers can have a sign");
  }
  if (format.zeros && !format.is_text_number())
    return wrong("only numbers can be filled with zeros");
  if (format.kind == Kind::character && format.width > 1) {
    return wrong("a char field has exactly one character; write text for several characters");
  }
  if (format.kind == Format::Kind::byte && format.width > 1) {
    return wrong("a byte field has exactly one byte; write bytes to skip several");
  }
  return {};
}

}  // namespace

bool Format::is_whole_number() const {
  return kind == Kind::integer || kind == Kind::hex || kind == Kind::uint || kind == Kind::sint ||
         kind == Kind::bcd;
}

std::optional<unsigned> Format::bits() const {
  if (!is_whole_number() || width == 0) return std::nullopt;
  if (kind == Kind::hex) return static_cast<unsigned>(std::min<std::size_t>(4 * width, 64));
  if (kind == Kind::uint || kind == Kind::sint) return static_cast<unsigned>(8 * width);
  const std::size_t digits = kind == Kind::bcd ? 2 * width : width;
  std::uint64_t most = 0;
  for (std::size_t i = 0; i < digits; ++i) {
    if (most > std::numeric_limits<std::uint64_t>::max() / 10 - 1) return 64;
    most = most * 10 + 9;
  }
  return static_cast<unsigned>(std::bit_width(most));
}

config::RawNumbers NumbersOf(const Format& format) {
  using config::RawNumbers;
  if (format.kind == Kind::real) {
    return {format.width == 4 ? RawNumbers::Kind::single : RawNumbers::Kind::real, {}};
  }
  if (!format.is_whole_number()) return {};
  const auto bits = format.bits();
  if (!bits || format.kind == Kind::integer) {
    return RawNumbers::Whole(std::numeric_limits<std::int64_t>::min(),
                             std::numeric_limits<std::uint64_t>::max());
  }
  if (format.kind != Kind::bcd) return RawNumbers::Bits(*bits, format.kind == Kind::sint);
  const auto end = Decimal(1).Shifted(2 * static_cast<int>(format.width)).ToUint64();
  return RawNumbers::Whole(0, end ? *end - 1 : std::numeric_limits<std::uint64_t>::max());
}

Result<Format> ParseFormat(std::string_view text) {
  if (text.empty()) return Format{};
  if (const auto binary = ParseBinary(text)) return *binary;
  Format format;
  std::string_view rest = text;
  if (rest.starts_with('+')) {
    format.sign = true;
    rest.remove_prefix(1);
  }
  if (rest.starts_with('0')) {
    format.zeros = true;
    rest.remove_prefix(1);
  }
  if (!rest.empty() && rest.front() >= '0' && rest.front() <= '9') {
    const auto width = TakeNumber(rest, kWidestField, "width");
    if (!width) return Error{width.error()};
    format.width = *width;
  }
  if (rest.starts_with('.')) {
    rest.remove_prefix(1);
    format.point = true;
    if (!rest.empty() && rest.front() >= '0' && rest.front() <= '9') {
      const auto precision = TakeNumber(rest, kMostDecimals, "precision");
      if (!precision) return Error{precision.error()};
      format.precision = static_cast<int>(*precision);
      format.point = format.precision > 0;
    }
  }
  for (const KindWord& one : kTextWords) {
    if (one.word != rest) continue;
    format.kind = one.kind;
    format.lower = rest == "x";
    if (one.kind == Kind::character || one.kind == Kind::byte)
      format.width = std::max<std::size_t>(format.width, 1);
    if (Status status = CheckTextFormat(format, text); !status) return Error{status.error()};
    return format;
  }
  return UnknownFormat(text);
}

namespace {

using Kind = Format::Kind;

constexpr std::string_view kDigits = "0123456789";

bool AllDigits(std::string_view text) {
  return !text.empty() && text.find_first_not_of(kDigits) == std::string_view::npos;
}

/// True if the text is a number without a sign ("12.5" or "12") with as many decimals as the format
/// requires.
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

/// Returns the text without the blanks that can be beside a number: in front of it, or, in a field
/// of fixed width with numbers at the left, behind it. Other blanks stay and make the number
/// invalid: "5  kg" may be a damaged "50 kg". Hex digits of fixed width and zero-padded numbers
/// have no blanks. Blanks behind an exponent or a point stay, because they have replaced a digit:
/// "1.25E+0 ", "12. ".
std::string_view WithoutBlanks(const Format& format, std::string_view text) {
  if (format.width > 0 && (format.zeros || format.kind == Kind::hex)) return text;
  if (text.starts_with(' ')) return text.substr(std::min(text.find_first_not_of(' '), text.size()));
  const bool may_end = format.kind == Kind::decimal || format.kind == Kind::integer;
  if (format.width == 0 || !format.left || !may_end) return text;
  const std::string_view number = Trim(text);
  return number.size() < text.size() && number.ends_with('.') ? text : number;
}

/// Sign and digits of a number. In a field of fixed width blanks can be between them: "+  12.5".
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
    // A hex number must not have a sign, which ParseInteger accepts.
    if (!number || !HexDigit(digits.front())) return {};
    return WholeValue(false, *number);
  }
  const SignedText parts = TakeSign(format, text);
  if (format.sign && !parts.has_sign) return {};
  std::string_view mantissa = parts.digits;
  std::string_view exponent;
  if (format.kind == Kind::scientific) {
    // The form of the exponent is checked exactly, because a lost character would change the number
    // by powers of ten.
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
    // -0.0 + 0.0 is 0.0, so "-0.0" gives no negative zero.
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

namespace {

constexpr std::array<Meaning, 10> kMeanings = {
    {{"good", Quality::good},
     {"uncertain", Quality::uncertain},
     {"busy", {Quality::bad, Reason::not_ready}, true},
     {"over", {Quality::bad_sensor_failure, Reason::over_range}},
     {"under", {Quality::bad_sensor_failure, Reason::under_range}},
     {"open", {Quality::bad_sensor_failure, Reason::open_sensor}},
     {"disabled", {Quality::bad_out_of_service, Reason::channel_disabled}},
     {"not_ready", {Quality::bad, Reason::not_ready}},
     {"fault", {Quality::bad_device_failure, Reason::device_fault}},
     {"bad", Quality::bad}}};

constexpr std::string_view kDots = "..";

/// True if codes of the field are compared as numbers: 9.9E37 has several notations, and binary
/// fields have no text.
bool IsByNumber(const Format& format) {
  return format.is_binary() || format.kind == Format::Kind::scientific;
}

struct Range {
  std::optional<Decimal> low;
  std::optional<Decimal> high;
};

/// Parses a code that is a range of numbers. Returns nothing if the code is not a range. Dots
/// without a number beside them are a text.
std::optional<Range> ParseRange(std::string_view code) {
  const std::size_t dots = code.find(kDots);
  if (dots == std::string_view::npos) return std::nullopt;
  const std::string_view low = Trim(code.substr(0, dots));
  const std::string_view high = Trim(code.substr(dots + kDots.size()));
  const Range range{Decimal::Parse(low), Decimal::Parse(high)};
  const bool whole = (range.low || low.empty()) && (range.high || high.empty());
  return whole && (range.low || range.high) ? std::optional(range) : std::nullopt;
}

/// Returns the number as the field stores it. Example: a float32 stores not 999.9, but its nearest
/// neighbour.
Decimal Held(const Format& format, const Decimal& number) {
  const bool single = format.kind == Format::Kind::real && format.width == 4;
  const double nearest = number.ToDouble();
  const bool fits = std::abs(nearest) <= std::numeric_limits<float>::max();
  return single && fits ? Decimal(double{static_cast<float>(nearest)}) : number;
}

const Meaning* FindNumber(const Codes& codes, const Value& value) {
  for (const auto& [code, meaning] : codes) {
    const auto own = Decimal::Parse(code);
    if (own && IsMeant(value, *own)) return meaning;
  }
  return nullptr;
}

const Meaning* FindRange(const Codes& codes, const Format& format, const Decimal& number) {
  for (const auto& [code, meaning] : codes) {
    const auto range = ParseRange(code);
    if (!range || (range->low && number < Held(format, *range->low))) continue;
    if (!range->high || number <= Held(format, *range->high)) return meaning;
  }
  return nullptr;
}

}  // namespace

std::span<const Meaning> Meanings() { return kMeanings; }

Status CheckCode(const Format& format, std::string_view code) {
  if (!format.is_number()) return {};
  if (const auto range = ParseRange(code)) {
    if (!range->low || !range->high || *range->low <= *range->high) return {};
    return Error{"has a first number that is larger than the second; swap the numbers"};
  }
  const std::size_t dots = code.find(kDots);
  if (dots != std::string_view::npos &&
      (Decimal::Parse(Trim(code.substr(0, dots))) || Decimal::Parse(Trim(code.substr(dots + 2))))) {
    return Error{"is not a range; write '9.9E37..', '..-9.9E37' or '900..999'"};
  }
  if (!format.is_binary()) return {};
  const auto number = Decimal::Parse(code);
  if (!number) return Error{"is not a number, but the field contains numbers only"};
  if (NumbersOf(format).Contain(*number)) return {};
  return Error{"can never occur; write a number that the bytes of the field can hold"};
}

Value NumberOf(const Format& format, std::string_view code) {
  const auto range = format.is_number() ? ParseRange(code) : std::nullopt;
  if (range) return (range->low ? range->low : range->high)->ToValue();
  const auto number = IsByNumber(format) ? Decimal::Parse(code) : std::nullopt;
  return number ? number->ToValue() : Value{};
}

const Meaning* FindCode(const Codes& codes, const Format& format, View bytes, const Value& value) {
  if (codes.empty()) return nullptr;
  const auto number = format.is_number() ? Decimal::Of(value) : std::nullopt;
  if (number && IsByNumber(format)) {
    if (const Meaning* meaning = FindNumber(codes, value)) return meaning;
  }
  if (format.kind == Format::Kind::byte) {
    const auto found = codes.find(ByteText(bytes));
    return found == codes.end() ? nullptr : found->second;
  }
  const std::string_view text = AsText(bytes);
  const auto found = codes.find(format.kind == Format::Kind::character ? text : Trim(text));
  if (found != codes.end() && !format.is_binary()) return found->second;
  return number ? FindRange(codes, format, *number) : nullptr;
}

}  // namespace baudgate::protocols::telegram
