// Functions for text: hex, numbers, UTF-8, patterns, quoting, splitting and trimming. None uses the
// locale. Nearest finds the known word that a misspelt one was meant to be.
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

/// "3E 31 52"; upper case, one space between bytes.
std::string ToHex(View bytes);
/// Two upper-case digits.
std::string HexByte(std::uint8_t byte);
/// Reads hex with or without spaces, either case. Nothing on an odd digit count or another
/// character.
std::optional<Bytes> ParseHex(std::string_view text);
/// CR or LF.
constexpr bool IsLineEnd(std::uint8_t byte) { return byte == '\r' || byte == '\n'; }
/// 0…15, or nothing.
std::optional<std::uint8_t> HexDigit(char c);

/// The whole text as a number in `base`; no sign "+", no spaces, no rest, no overflow.
template <typename T>
std::optional<T> ParseInteger(std::string_view text, int base = 10) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// The whole text as a decimal number, with an optional sign ("+" too); the point is always '.'.
/// No exponent, no "inf", no "nan": no device of ours sends them and a typing error should not
/// pass.
std::optional<double> ParseDecimal(std::string_view text);

/// The shortest text that reads back as the same number; never locale dependent.
std::string FormatNumber(double value);

/// Printable ASCII for people: "\r" and other control bytes escaped.
std::string Printable(View bytes);

/// The first byte from `begin` on that cannot be part of UTF-8 text, or is NUL (UTF-16 is full of
/// them); npos: there is none.
std::size_t FirstNotUtf8(std::string_view text, std::size_t begin = 0);

/// "10.0.0.9:502", "[::1]:502".
std::string HostAndPort(const std::string& host, std::uint16_t port);

/// Where a pattern has * for any text and ? for any character.
bool MatchesPattern(std::string_view pattern, std::string_view text);

std::string_view Trim(std::string_view text);
std::vector<std::string_view> Split(std::string_view text, char separator);
/// Its parts would outlive the text.
template <std::same_as<std::string> Temporary>
std::vector<std::string_view> Split(Temporary&& text, char separator) = delete;

}  // namespace baudgate

namespace baudgate {

// Which known word a misspelt one was probably meant to be, for "did you mean" in messages.

/// The nearest of `known` by edit distance; empty when none is near enough to be a slip.
std::string_view Nearest(std::string_view word, std::span<const std::string_view> known);

/// "a, b, c".
std::string Join(std::span<const std::string_view> words);

/// In quotes, shortened where it is long: "'adress'".
std::string Quoted(std::string_view text);

/// An unknown key, in quotes only as far as it looks like one: "'password…'" of
/// "password:SECRET", because what follows may be a secret.
std::string QuotedKey(std::string_view key);

/// " is the blank after the colon missing?" and the like, or nothing where it looks like a key.
std::string MissingMark(std::string_view key);

/// " did you mean 'x'?" with the leading blank, or nothing.
std::string DidYouMean(std::string_view word, std::span<const std::string_view> known);

/// As lower case, ASCII letters only; never locale dependent.
std::string Lower(std::string_view text);

}  // namespace baudgate
