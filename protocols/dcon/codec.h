// Builds and takes apart whole DCON frames: delimiter, address, text, checksum, CR. Frames come
// from the frame rules and go to decode.h; requests go from conversation.h to the line.
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

/// Expectation::checksum of this protocol.
enum ChecksumVariant : int {
  kNoChecksum = 0,
  kChecksum = 1,        ///< two hex digits before CR
  kChecksumEither = 2,  ///< there, or right behind '>' of a counter reply (I-7080)
  kChecksumFront = 3,   ///< counter replies: right behind '>'; all others before CR
};

/// "74" or "0x4A": 0…255.
Result<std::uint8_t> ParseAddress(std::string_view text);

/// A request without address, checksum and CR: `text` is "#" for `#01`, "$6" for `$016`.
struct Command {
  std::uint8_t address = 0;
  bool broadcast = false;  ///< "**" stands for the address; nobody answers
  std::string text;        ///< leading delimiter and all that follows the address
};

/// `command` begins with its delimiter: ("#3", 1, true) gives `#013B7\r`.
Bytes BuildRequest(std::string_view command, std::uint8_t address, bool checksum);

/// To all modules: "#**" gives `#**77\r`.
Bytes BuildBroadcast(std::string_view text, bool checksum);

/// Nothing unless the whole frame is a request with a good address and, where due, checksum.
std::optional<Command> ParseRequest(View frame, bool checksum);

/// One digit at least, and nothing else.
bool IsHexText(std::string_view text);
bool IsDecimalText(std::string_view text);

struct Reply {
  char lead = 0;           ///< '>', '!' or '?'
  std::string body;        ///< between the lead and the checksum
  bool ambiguous = false;  ///< both checksum places fit, so the body may be either
};

Bytes BuildReply(std::string_view text, bool checksum);
/// `>[CHK](data)`: the order of I-7080 counter replies.
Bytes BuildCounterReplyFront(std::string_view data);

std::optional<Reply> ParseReply(View frame, int variant);

/// Whether `line`, a frame without its CR, carries the checksum that `variant` demands.
bool ChecksumFits(std::string_view line, int variant);

}  // namespace baudgate::protocols::dcon
