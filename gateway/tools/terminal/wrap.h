// Text in lines of a terminal: broken at words, further lines indented.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace baudgate {

/// Lines of `width` characters at most, broken at blanks; a word that is longer is broken where its
/// line ends. One line at least. Width 0: no limit.
std::vector<std::string> WrapLines(std::string_view text, std::size_t width);

/// The same as text: each line ends in '\n', and each but the first begins with `indent` blanks.
std::string WrapSentence(std::string_view text, std::size_t width, std::size_t indent = 2);

}  // namespace baudgate
