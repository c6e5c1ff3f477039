// Builds and parses whole DCON frames: delimiter, address, text, checksum, CR.
// protocols/dcon/rules.h cuts frames out of received bytes, protocols/dcon/decode.h reads parsed
// replies.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "gateway/base/bytes.h"
#include "gateway/base/result.h"

namespace baudgate::protocols::dcon {

/// Maximum length: delimiter 1, address 2, command 5, data 256, checksum 2, CR.
inline constexpr std::size_t kMaxFrame = 268;

/// Position of the checksum in a DCON frame; values of Expectation::checksum
/// (protocols/frame_rule.h).
enum ChecksumVariant : int {
  kNoChecksum = 0,
  kChecksum = 1,  ///< two hex digits before CR
  /// Two hex digits before CR, or right after '>' of a counter reply (I-7080).
  kChecksumEither = 2,
  kChecksumFront = 3,  ///< right after '>' of a counter reply, before CR in all other replies
};

/// Parses the address 0…255 of a module, in decimal ("74") or hex ("0x4A").
Result<std::uint8_t> ParseAddress(std::string_view text);

/// A parsed request. `text` is the delimiter with the characters between address and checksum: "#"
/// for `#01`, "$6" for `$016`.
struct Command {
  std::uint8_t address = 0;
  /// True: the request has "**" in place of the address, and no module answers.
  bool broadcast = false;
  std::string text;
};

/// Builds a request frame. `command` begins with its delimiter. Example: ("#3", 1, true) returns
/// `#013B7\r`.
Bytes BuildRequest(std::string_view command, std::uint8_t address, bool checksum);

/// Builds a request to all modules. Example: "#**" returns `#**77\r`.
Bytes BuildBroadcast(std::string_view text, bool checksum);

/// Parses a request. Returns nothing unless the whole frame is a valid request; with `checksum`
/// true it must end with a correct checksum.
std::optional<Command> ParseRequest(View frame, bool checksum);

/// True if `text` contains at least one hex digit and no other characters.
bool IsHexText(std::string_view text);
bool IsDecimalText(std::string_view text);

struct Reply {
  char lead = 0;     ///< '>', '!' or '?'
  std::string body;  ///< the characters between the lead and the checksum
  /// True: the checksum fits in front and at the end, so it is unknown which characters are the
  /// data.
  bool ambiguous = false;
};

Bytes BuildReply(std::string_view text, bool checksum);
Bytes BuildCounterReplyFront(std::string_view data);

std::optional<Reply> ParseReply(View frame, int variant);

/// True if `line`, a frame without its CR, contains the checksum that `variant` requires.
bool ChecksumFits(std::string_view line, int variant);

}  // namespace baudgate::protocols::dcon
