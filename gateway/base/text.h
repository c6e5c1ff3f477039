// Functions for text: hex, numbers, UTF-8, patterns, quoting, splitting, trimming, and Nearest,
// which finds the known word for a misspelt one. No function uses the locale.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <charconv>
#include <concepts>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/base/bytes.h"

namespace baudgate {

/// Returns "3E 31 52": upper case, one space between bytes.
std::string ToHex(View bytes);
/// Returns the byte as two upper-case digits.
std::string HexByte(std::uint8_t byte);
/// Reads hex of either case, with or without spaces between the bytes. Returns nothing for an odd
/// number of digits or another character.
std::optional<Bytes> ParseHex(std::string_view text);
constexpr bool IsLineEnd(std::uint8_t byte) { return byte == '\r' || byte == '\n'; }
std::optional<std::uint8_t> HexDigit(char c);

/// Reads the whole text as a number in `base`. Returns nothing for a "+", a space, other characters
/// behind the number, or an overflow.
template <typename T>
std::optional<T> ParseInteger(std::string_view text, int base = 10) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Reads the whole text as a decimal number with an optional sign ("-" or "+"); the point is always
/// '.'. Refuses exponents, "inf" and "nan", because no device sends them, and they would be typing
/// errors.
std::optional<double> ParseDecimal(std::string_view text);

/// Returns the shortest text that reads back as the same number.
std::string FormatNumber(double value);

/// Returns the bytes as printable ASCII: "\r", "\n", and "\x1B" for other unprintable bytes.
std::string Printable(View bytes);

/// Returns UTF-8 text in which control characters, and characters that change the direction of
/// writing, are replaced by "\x1B": a name that a client has chosen must not forge lines.
std::string WithoutControls(std::string_view text);

/// Returns the position of the first byte from `begin` on that cannot be part of UTF-8 text, or is
/// NUL (UTF-16 contains many NULs); npos if there is none.
std::size_t FirstNotUtf8(std::string_view text, std::size_t begin = 0);

/// Returns "10.0.0.9:502", or "[::1]:502" for IPv6.
std::string HostAndPort(const std::string& host, std::uint16_t port);

/// True if `text` matches `pattern`, in which * is any text and ? any character.
bool MatchesPattern(std::string_view pattern, std::string_view text);

std::string_view Trim(std::string_view text);
std::vector<std::string_view> Split(std::string_view text, char separator);
/// Deleted, because the parts would outlive a temporary text.
template <std::same_as<std::string> Temporary>
std::vector<std::string_view> Split(Temporary&& text, char separator) = delete;

}  // namespace baudgate

namespace baudgate {

/// Returns the word of `known` with the smallest edit distance, at most a third of the length of
/// `word` (at least 1); else an empty text.
std::string_view Nearest(std::string_view word, std::span<const std::string_view> known);

/// Returns "a, b, c".
std::string Join(std::span<const std::string_view> words);

/// Returns the text in quotes, cut after 60 bytes: "'adress'".
std::string Quoted(std::string_view text);

/// Returns an unknown key in quotes, cut where it stops looking like a key: "'password…'" for
/// "password:SECRET", because the rest may be a secret.
std::string QuotedKey(std::string_view key);

/// For an unknown key of a YAML file: returns " is the blank after the colon missing?" or " is a
/// colon missing?"; an empty text if neither is likely.
std::string MissingMark(std::string_view key);

/// Returns " did you mean 'x'?" with the leading blank; an empty text if no known word is similar.
std::string DidYouMean(std::string_view word, std::span<const std::string_view> known);

/// Converts ASCII letters to lower case.
std::string Lower(std::string_view text);

/// Returns a name of the program as words for people: "no reply" for "no_reply".
std::string InWords(std::string_view name);

}  // namespace baudgate
