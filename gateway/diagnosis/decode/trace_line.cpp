// SPDX-License-Identifier: Apache-2.0
#include "gateway/diagnosis/decode/trace_line.h"

#include <algorithm>
#include <string>
#include <utility>

#include "gateway/base/text.h"

namespace baudgate {
namespace {

/// In the place of a masked byte. SPA takes "XX" for any checksum.
constexpr std::uint8_t kUnknown = 'X';

std::string_view TakeWord(std::string_view& text) {
  const std::string_view word = text.substr(0, text.find(' '));
  text = Trim(text.substr(word.size()));
  return word;
}

}  // namespace

Duration TimeOfDay(std::string_view clock) {
  constexpr std::size_t kDigits = 15;
  if (clock.size() != kDigits) return {};
  const auto part = [&](std::size_t at, std::size_t count) {
    return ParseInteger<std::int64_t>(clock.substr(at, count)).value_or(0);
  };
  return std::chrono::hours(part(0, 2)) + std::chrono::minutes(part(3, 2)) +
         std::chrono::seconds(part(6, 2)) + std::chrono::microseconds(part(9, 6));
}

Duration Between(Duration from, Duration to) { return to >= from ? to - from : to + 24h - from; }

TraceLine ReadTraceLine(std::string_view line) {
  TraceLine marked;
  std::string_view text = Trim(line);
  constexpr std::string_view kClock = "00:00:00.000000";
  const std::string_view first = text.substr(0, text.find(' '));
  const bool timed =
      std::equal(first.begin(), first.end(), kClock.begin(), kClock.end(),
                 [](char c, char form) { return form == '0' ? c >= '0' && c <= '9' : c == form; });
  if (timed) {
    marked.time = TakeWord(text);
    marked.device = TakeWord(text);
    const std::size_t bar = text.starts_with('=') ? std::string_view::npos : text.find('|');
    if (bar != std::string_view::npos) marked.shown = Trim(text.substr(bar + 1));
    text = text.substr(0, bar);
  }
  if (text.empty()) return marked;
  marked.mark = text.front();
  marked.rest = text.substr(1);
  return marked;
}

std::optional<MaskedHex> ParseMaskedHex(std::string_view text) {
  MaskedHex hex;
  std::string plain(text);
  for (auto at = plain.find("**"); at != std::string::npos; at = plain.find("**", at)) {
    plain.replace(at, 2, HexByte(kUnknown));
    hex.masked = true;
  }
  auto bytes = ParseHex(Trim(plain));
  if (!bytes) return std::nullopt;
  hex.bytes = std::move(*bytes);
  return hex;
}

std::optional<Outcome> OutcomeOf(std::string_view text) {
  const std::string_view word = Trim(text.substr(0, text.find_first_of(",:")));
  for (std::size_t i = 0; i < kOutcomeCount; ++i) {
    if (word == Name(static_cast<Outcome>(i))) return static_cast<Outcome>(i);
  }
  return std::nullopt;
}

std::string_view ReasonOf(std::string_view text) {
  const auto colon = text.find(':');
  return colon == std::string_view::npos ? std::string_view() : Trim(text.substr(colon + 1));
}

}  // namespace baudgate
