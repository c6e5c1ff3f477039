// One line of a capture: what `trace` prints, the flight recorder saves, or somebody has written.
//
//   > 3E 31 52 49
//   04:05:06.143210 feeder-1 < 3C 31 44 3A | <1D:
//   04:05:06.143300 feeder-1 = corrupt, 19.8 ms: checksum
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

#include "gateway/base/bytes.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"

namespace baudgate {

/// A mark (0: none) and what follows it; of a trace also when and with which device. Parts of
/// the line.
struct TraceLine {
  char mark = 0;
  std::string_view rest;  ///< without the characters behind '|'
  std::string_view time;
  std::string_view device;
  std::string_view shown;  ///< the characters behind '|'
};
TraceLine ReadTraceLine(std::string_view line);

/// Bytes that nobody asked for and that come later than this belong to no message before them.
inline constexpr Duration kApart = 50ms;
/// The time since midnight of "04:05:06.123456"; zero: it is none.
Duration TimeOfDay(std::string_view clock);
/// From one time of day to the next, over midnight as well.
Duration Between(Duration from, Duration to);

struct MaskedHex {
  Bytes bytes;
  bool masked = false;  ///< some were "**", in whose place stands another byte
};
/// "3E 31 ** 0D"; nothing when it is none.
std::optional<MaskedHex> ParseMaskedHex(std::string_view text);

/// The outcome in what follows "=": "corrupt, 27.3 ms: checksum".
std::optional<Outcome> OutcomeOf(std::string_view end);
/// What follows its colon; empty: nothing does.
std::string_view ReasonOf(std::string_view end);

}  // namespace baudgate
