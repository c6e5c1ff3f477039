// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/format.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <string>

#include "gateway/base/spelling.h"
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

/// Those that are written most, for a suggestion.
constexpr std::array<std::string_view, 12> kBinaryWords = {
    "uint8",    "uint16_be", "uint16_le", "uint32_be", "uint32_le",  "int8",
    "int16_be", "int16_le",  "int32_be",  "int32_le",  "float32_be", "float32_le"};

/// Digits at the front of `text`, taken off it.
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

/// "uint16_le", "int24", "float32_be", "bcd3".
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
  return {config::Quoted(text) + " is no format;" + config::DidYouMean(text, words) +
          " formats: " + std::string(kAllKinds)};
}

Status CheckTextFormat(const Format& format, std::string_view text) {
  const bool real = format.kind == Kind::decimal || format.kind == Kind::scientific;
  const auto wrong = [&](const char* why) { return Error{config::Quoted(text) + ": " + why}; };
  if ((format.precision >= 0 || format.point) && !real) {
    return wrong("only decimal and scientific numbers have a point");
  }
  if (format.sign && (!format.is_text_number() || format.kind == Kind::hex)) {
    return wrong("only numbers have a sign");
  }
  if (format.zeros && !format.is_text_number()) return wrong("only numbers are filled with zeros");
  if (format.kind == Kind::character && format.width > 1) {
    return wrong("a char is one character; write text for more");
  }
  if (format.kind == Format::Kind::byte && format.width > 1) {
    return wrong("a byte is one; write bytes to pass several over");
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

}  // namespace baudgate::protocols::telegram
