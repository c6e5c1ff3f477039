// Which known word a misspelt one was probably meant to be, for "did you mean" in messages.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace baudgate::config {

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

}  // namespace baudgate::config
