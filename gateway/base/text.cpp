// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/text.h"

#include <algorithm>
#include <cmath>

namespace baudgate {
namespace {

constexpr std::string_view kHexDigits = "0123456789ABCDEF";

struct Lead {
  unsigned char first, last, second_from, second_to;
  std::size_t length;
};
/// Valid first and second bytes by RFC 3629: no overlong forms, no surrogates of UTF-16, nothing
/// beyond U+10FFFF. NUL is left out.
constexpr Lead kLeads[] = {
    {0x01, 0x7F, 0x00, 0x00, 1}, {0xC2, 0xDF, 0x80, 0xBF, 2}, {0xE0, 0xE0, 0xA0, 0xBF, 3},
    {0xE1, 0xEC, 0x80, 0xBF, 3}, {0xED, 0xED, 0x80, 0x9F, 3}, {0xEE, 0xEF, 0x80, 0xBF, 3},
    {0xF0, 0xF0, 0x90, 0xBF, 4}, {0xF1, 0xF3, 0x80, 0xBF, 4}, {0xF4, 0xF4, 0x80, 0x8F, 4}};

/// Returns the length of the UTF-8 character at the front; 0 if the text begins with no valid
/// character.
std::size_t CharacterLength(std::string_view text) {
  const auto byte = [text](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const auto* const lead = std::ranges::find_if(
      kLeads, [&](const Lead& one) { return byte(0) >= one.first && byte(0) <= one.last; });
  if (lead == std::end(kLeads) || lead->length > text.size()) return 0;
  for (std::size_t i = 1; i < lead->length; ++i) {
    const unsigned char from = i == 1 ? lead->second_from : 0x80;
    const unsigned char to = i == 1 ? lead->second_to : 0xBF;
    if (byte(i) < from || byte(i) > to) return 0;
  }
  return lead->length;
}

}  // namespace

std::string HexByte(std::uint8_t byte) { return {kHexDigits[byte >> 4U], kHexDigits[byte & 15U]}; }

std::string ToHex(View bytes) {
  std::string text;
  text.reserve(bytes.size() * 3);
  for (const std::uint8_t byte : bytes) {
    if (!text.empty()) text += ' ';
    text += HexByte(byte);
  }
  return text;
}

std::optional<std::uint8_t> HexDigit(char c) {
  if (c >= '0' && c <= '9') return static_cast<std::uint8_t>(c - '0');
  if (c >= 'A' && c <= 'F') return static_cast<std::uint8_t>(c - 'A' + 10);
  if (c >= 'a' && c <= 'f') return static_cast<std::uint8_t>(c - 'a' + 10);
  return std::nullopt;
}

std::optional<Bytes> ParseHex(std::string_view text) {
  Bytes bytes;
  std::optional<std::uint8_t> high;
  for (const char c : text) {
    if (c == ' ' && !high) continue;
    const auto digit = HexDigit(c);
    if (!digit) return std::nullopt;
    if (!high) {
      high = digit;
    } else {
      bytes.push_back(static_cast<std::uint8_t>((*high << 4U) | *digit));
      high.reset();
    }
  }
  if (high) return std::nullopt;
  return bytes;
}

std::optional<double> ParseDecimal(std::string_view text) {
  if (!text.empty() && text.front() == '+') {
    text.remove_prefix(1);
    if (text.empty() || text.front() == '-') return std::nullopt;
  }
  if (text.find_first_not_of("-.0123456789") != std::string_view::npos) return std::nullopt;
  if (text.find_first_of("0123456789") == std::string_view::npos) return std::nullopt;
  double value = 0;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value, std::chars_format::fixed);
  if (error != std::errc() || stop != end) return std::nullopt;
  return value;
}

std::string FormatNumber(double value) {
  if (std::isnan(value)) return "nan";
  char buffer[64];
  const double size = std::abs(value);
  // People read 100000, not 1e+05, so an exponent is used only for very large and very small
  // numbers.
  const bool plain = size == 0 || (size >= 1e-6 && size < 1e15);
  const auto [end, error] =
      plain ? std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::fixed)
            : std::to_chars(buffer, buffer + sizeof buffer, value);
  return error == std::errc() ? std::string(buffer, end) : "nan";
}

namespace {

/// Returns the number of bytes of the character at `at` if it must not be shown, else 0:
///
///   U+0080 to U+009F                       control characters
///   U+200B to U+200F, U+2028, U+2029       characters without width, and line ends
///   U+202A to U+202E, U+2066 to U+2069     change the direction of writing (Annex 9 of Unicode)
///
std::size_t HiddenAt(std::string_view text, std::size_t at) {
  const auto byte = [&](std::size_t i) {
    return at + i < text.size() ? static_cast<std::uint8_t>(text[at + i]) : std::uint8_t{0};
  };
  const auto is_between = [&](std::uint8_t least, std::uint8_t most) {
    return byte(2) >= least && byte(2) <= most;
  };
  if (byte(0) == 0xC2 && byte(1) >= 0x80 && byte(1) <= 0x9F) return 2;
  if (byte(0) != 0xE2) return 0;
  if (byte(1) == 0x80 && (is_between(0x8B, 0x8F) || is_between(0xA8, 0xAE))) return 3;
  return byte(1) == 0x81 && is_between(0xA6, 0xA9) ? 3 : 0;
}

}  // namespace

std::string WithoutControls(std::string_view text) {
  std::string clean;
  for (std::size_t i = 0; i < text.size();) {
    const auto byte = static_cast<std::uint8_t>(text[i]);
    const bool is_control = byte < 0x20 || byte == 0x7F;
    const std::size_t hidden = is_control ? 1 : HiddenAt(text, i);
    for (const char c : text.substr(i, hidden)) {
      clean += "\\x" + HexByte(static_cast<std::uint8_t>(c));
    }
    if (hidden == 0) clean += text[i];
    i += std::max<std::size_t>(hidden, 1);
  }
  return clean;
}

std::string Printable(View bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    if (byte >= 0x20 && byte < 0x7F) {
      text += static_cast<char>(byte);
    } else if (byte == '\r') {
      text += "\\r";
    } else if (byte == '\n') {
      text += "\\n";
    } else {
      text += "\\x" + HexByte(byte);
    }
  }
  return text;
}

std::size_t FirstNotUtf8(std::string_view text, std::size_t begin) {
  for (std::size_t at = begin; at < text.size();) {
    const std::size_t length = CharacterLength(text.substr(at));
    if (length == 0) return at;
    at += length;
  }
  return std::string_view::npos;
}

std::string HostAndPort(const std::string& host, std::uint16_t port) {
  const bool is_v6 = host.find(':') != std::string::npos;
  return (is_v6 ? "[" + host + "]" : host) + ":" + std::to_string(port);
}

bool MatchesPattern(std::string_view pattern, std::string_view text) {
  std::size_t p = 0;
  // `star` is the last star in the pattern that was reached. Its match ends before position `tried`
  // of `text`; if the rest of the pattern does not fit, the match becomes one character longer.
  std::size_t star = std::string_view::npos;
  std::size_t tried = 0;
  for (std::size_t t = 0; t < text.size();) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      tried = t;
    } else if (p < pattern.size() && (pattern[p] == '?' || pattern[p] == text[t])) {
      ++p;
      ++t;
    } else if (star != std::string_view::npos) {
      p = star + 1;
      t = ++tried;
    } else {
      return false;
    }
  }
  return pattern.find_first_not_of('*', p) == std::string_view::npos;
}

std::string_view Trim(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r\n";
  const auto first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

std::vector<std::string_view> Split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (;;) {
    const auto at = text.find(separator);
    parts.push_back(text.substr(0, at));
    if (at == std::string_view::npos) return parts;
    text.remove_prefix(at + 1);
  }
}

}  // namespace baudgate

namespace baudgate {
namespace {

constexpr std::size_t kLongestWord = 64;
constexpr std::size_t kLongestQuote = 60;

std::string_view KeyPart(std::string_view text) {
  const auto end = std::ranges::find_if_not(text, [](char c) {
    const auto lower = static_cast<char>(c | 0x20);
    return (lower >= 'a' && lower <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '.' ||
           c == '-';
  });
  return text.substr(0, static_cast<std::size_t>(end - text.begin()));
}

// Computes the optimal string alignment distance: two swapped letters count as one error.
std::size_t EditDistance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before_last(b.size() + 1);
  std::vector<std::size_t> last(b.size() + 1);
  std::vector<std::size_t> current(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) last[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    current[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t change = last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      current[j] = std::min({last[j] + 1, current[j - 1] + 1, change});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) current[j] = std::min(current[j], before_last[j - 2] + 1);
    }
    std::swap(before_last, last);
    std::swap(last, current);
  }
  return last[b.size()];
}

}  // namespace

std::string_view Nearest(std::string_view word, std::span<const std::string_view> known) {
  if (word.empty() || word.size() > kLongestWord) return {};
  const std::string lowered = Lower(word);
  std::string_view best;
  std::size_t best_distance = std::max<std::size_t>(1, word.size() / 3) + 1;
  for (const std::string_view candidate : known) {
    if (candidate.size() > kLongestWord) continue;
    const std::size_t distance = EditDistance(lowered, Lower(candidate));
    if (distance < best_distance) {
      best = candidate;
      best_distance = distance;
    }
  }
  return best;
}

std::string Join(std::span<const std::string_view> words) {
  std::string text;
  for (const std::string_view word : words) {
    if (!text.empty()) text += ", ";
    text += word;
  }
  return text;
}

std::string Quoted(std::string_view text) {
  if (text.size() <= kLongestQuote) return "'" + std::string(text) + "'";
  std::size_t end = kLongestQuote;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) --end;
  return "'" + std::string(text.substr(0, end)) + "…'";
}

std::string QuotedKey(std::string_view key) {
  const std::string_view part = KeyPart(key).substr(0, kLongestQuote);
  return "'" + std::string(part) + (part.size() < key.size() ? "…'" : "'");
}

std::string MissingMark(std::string_view key) {
  const std::size_t end = KeyPart(key).size();
  if (end == 0 || end == key.size()) return {};
  if (key[end] == ':') return " is the blank after the colon missing?";
  return key[end] == ' ' ? " is a colon missing?" : "";
}

std::string DidYouMean(std::string_view word, std::span<const std::string_view> known) {
  const std::string_view nearest = Nearest(word, known);
  return nearest.empty() ? std::string() : " did you mean '" + std::string(nearest) + "'?";
}

std::string Lower(std::string_view text) {
  std::string lowered(text);
  for (char& c : lowered) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return lowered;
}

std::string InWords(std::string_view name) {
  std::string words(name);
  std::ranges::replace(words, '_', ' ');
  return words;
}

}  // namespace baudgate
