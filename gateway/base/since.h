// Times and spans as users give them to ask for what has been: `--since 2h`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "gateway/base/time.h"

namespace baudgate {

/// What FormatWallTime writes, or less of it: "2026-11-21", "2026-11-21T01:14", with a blank for
/// the T. Always UTC, with the Z or without.
Result<WallTime> ParseWallTime(std::string_view text);

/// "2h" before `now`, or a time.
Result<WallTime> ParseSince(std::string_view text, WallTime now);

}  // namespace baudgate
