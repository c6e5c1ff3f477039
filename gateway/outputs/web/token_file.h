// The file with the token that clients must show by HTTP.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gateway/base/result.h"

namespace baudgate::web {

inline constexpr std::size_t kShortestToken = 16;
inline constexpr std::size_t kLongestToken = 256;

/// Its first line. The error says what to do: it cannot be read, others may read it too (it needs
/// mode 0600), the token is too short, …
Result<std::string> ReadToken(const std::string& file);

}  // namespace baudgate::web
