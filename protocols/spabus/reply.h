// Replies of the SPA Bus: their text, their checksum in all its readings, and continued lines.
// Bytes come from the line through frame_rule.h to the conversation; the twin makes them here, too.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "gateway/base/bytes.h"
#include "protocols/spabus/codec.h"

namespace baudgate::protocols::spabus {

/// Bits of Expectation::checksum. The first four say what the checksum of a reply continued over
/// several lines may cover; no public source settles it, so more than one may be accepted.
inline constexpr int kCoversAll = 1;         ///< a: from `<` to the last colon, `&` CR LF included
inline constexpr int kCoversNoLineEnds = 2;  ///< b: without CR and LF
inline constexpr int kCoversCharacters = 4;  ///< c: without `&`, CR and LF
inline constexpr int kCoversLastLine = 8;    ///< d: the last line only
inline constexpr int kCoversAny = 15;
inline constexpr int kLineFeedCovered = 16;   ///< the LF before `<` counts, too
inline constexpr int kWildcardAccepted = 32;  ///< XX in place of a checksum passes

/// The most bytes that a reply of all permitted lines has: each line with its CR and LF.
inline constexpr std::size_t kMaxReply = kMaxLines * (kLongestLine + 2) + 1;

struct Reply {
  unsigned slave = 0;
  char type = 'D';          ///< D, A or N
  std::string data;         ///< of D: lines joined, before splitting at '/'
  std::optional<int> nack;  ///< of N: 0…9, when a digit was found
  bool continued = false;   ///< came in several lines
  bool wildcard = false;    ///< XX instead of a checksum
};

/// Reads a frame from `<` to its CR or CR LF; syntax only. Nothing when it is not a reply.
std::optional<Reply> ParseReply(View frame);

/// Which kCovers… readings give the checksum that the frame carries; 0 = none.
int MatchingReadings(View frame, bool line_feed_covered);

/// Whether the checksum passes under the bits `accepted`.
bool ChecksumPasses(View frame, int accepted);

/// How a slave computes the checksums of its replies: one of kCovers…, with kLineFeedCovered or
/// not. The frames begin with LF and end in CR LF.
std::optional<Bytes> EncodeData(unsigned slave, std::string_view data, int reading);
Bytes EncodeAck(unsigned slave, int reading);
Bytes EncodeNack(unsigned slave, int code, int reading);

}  // namespace baudgate::protocols::spabus
