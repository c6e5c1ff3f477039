// Builds and parses whole DCON frames: delimiter, address, text, checksum, CR. rules.h cuts frames
// out of received bytes, decode.h reads parsed replies.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "gateway/base/bytes.h"
#include "gateway/base/result.h"

namespace baudgate::protocols::dcon {

inline constexpr std::size_t kMaxFrame = 268;  ///< start 1, address 2, command 5, data 256, CHK, CR

/// Values of Expectation::checksum for DCON.
enum ChecksumVariant : int {
  kNoChecksum = 0,
  kChecksum = 1,        ///< two hex digits before CR
  kChecksumEither = 2,  ///< before CR, or right after '>' of a counter reply (I-7080)
  kChecksumFront = 3,   ///< right after '>' in counter replies, before CR in all other replies
};

/// Accepts 0…255, in decimal ("74") or hex ("0x4A").
Result<std::uint8_t> ParseAddress(std::string_view text);

/// A parsed request. Example: `text` is "#" for `#01` and "$6" for `$016`.
struct Command {
  std::uint8_t address = 0;
  bool broadcast = false;  ///< "**" is in place of the address: no module answers
  std::string text;        ///< delimiter and characters after the address, without checksum
};

/// `command` begins with its delimiter: ("#3", 1, true) returns `#013B7\r`.
Bytes BuildRequest(std::string_view command, std::uint8_t address, bool checksum);

/// Builds a request to all modules: "#**" returns `#**77\r`.
Bytes BuildBroadcast(std::string_view text, bool checksum);

/// Returns nothing unless the whole frame is a valid request, if `checksum` with a correct
/// checksum.
std::optional<Command> ParseRequest(View frame, bool checksum);

/// True if `text` contains at least one digit and no other characters.
bool IsHexText(std::string_view text);
bool IsDecimalText(std::string_view text);

struct Reply {
  char lead = 0;           ///< '>', '!' or '?'
  std::string body;        ///< the characters between the lead and the checksum
  bool ambiguous = false;  ///< the checksum fits at both ends, so `body` is uncertain
};

Bytes BuildReply(std::string_view text, bool checksum);
/// Builds `>[CHK](data)`, the counter reply of I-7080.
Bytes BuildCounterReplyFront(std::string_view data);

std::optional<Reply> ParseReply(View frame, int variant);

/// True if `line`, a frame without its CR, contains the checksum that `variant` requires.
bool ChecksumFits(std::string_view line, int variant);

}  // namespace baudgate::protocols::dcon
