// Encodes requests of the SPA Bus as text and decodes them: addresses of items, and frames. Wire
// format: protocols/spabus/README.md.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "gateway/base/bytes.h"
#include "gateway/base/result.h"

namespace baudgate::protocols::spabus {

inline constexpr std::uint8_t kCr = 0x0D;
inline constexpr std::uint8_t kLf = 0x0A;
/// The slave number for requests to all slaves, which no slave answers.
inline constexpr unsigned kBroadcast = 900;
/// The gateway sends lines of at most kMaxLine characters. It accepts lines of at most kLongestLine
/// characters, because devices older than version 2.1 of the protocol send 256, and replies of at
/// most kMaxLines lines.
inline constexpr std::size_t kMaxLine = 255;
inline constexpr std::size_t kLongestLine = 256;
inline constexpr std::size_t kMaxLines = 16;
/// The maximum number of digits of a channel, and of the number of an item or event.
inline constexpr std::size_t kChannelDigits = 3;
inline constexpr std::size_t kNumberDigits = 6;
/// These characters in place of the checksum mean that the receiver does not check the frame.
inline constexpr std::string_view kWildcard = "XX";

constexpr bool IsDigit(char c) { return c >= '0' && c <= '9'; }
/// True for printable ASCII. The bus uses no other characters except CR and LF.
constexpr bool IsPrintable(std::uint8_t byte) { return byte >= 0x20 && byte <= 0x7E; }
/// True for delimiters of the protocol, which a value cannot contain.
constexpr bool IsReserved(char c) {
  return c == '<' || c == '>' || c == ':' || c == '/' || c == '&';
}

struct Range {
  std::uint32_t first = 0;
  std::uint32_t last = 0;
  std::size_t Count() const { return static_cast<std::size_t>(last) - first + 1; }
  bool operator==(const Range&) const = default;
};

/// The address of one item of a slave. Examples: "I1", "14V1", "F".
struct Address {
  unsigned channel = 0;  ///< 0…999; 0: the channel is not given
  char category = 'I';
  std::optional<std::uint32_t> number;  ///< 0…999999; empty for categories without numbers
  auto operator<=>(const Address&) const = default;
};

/// True for the categories I, O, S, V, M, whose items have numbers. Each of the categories C, F, T,
/// D, A, L, B is a single item.
bool TakesNumber(char category);

/// Parses `[channel]category[number]`; the channel is 0 if it is left out. The error contains a
/// valid form.
Result<Address> ParseAddress(std::string_view text);
std::string FormatAddress(const Address& address);

/// Parses a slave number: 1…999 except 900. The error contains a valid form.
Result<unsigned> ParseSlave(std::string_view text);

struct Command {
  unsigned slave = 0;
  bool write = false;
  Range channels;
  char category = 'I';
  std::optional<Range> numbers;
  std::string data;
  bool operator==(const Command&) const = default;

  std::size_t ItemCount() const { return channels.Count() * (numbers ? numbers->Count() : 1); }
};

Command ReadOf(unsigned slave, const Address& first, std::uint32_t last_number);
Command WriteOf(unsigned slave, const Address& address, std::string data);

Bytes Encode(const Command& command, bool wildcard);

/// The content of a frame between `>` and CR, as a slave reads it.
struct ReceivedRequest {
  std::optional<unsigned> slave;
  bool intact = false;             ///< true: the checksum is right, or is XX
  std::optional<Command> command;  ///< empty: the syntax is wrong
  std::size_t data_at = 0;         ///< offset of Command::data in the frame
};
ReceivedRequest ParseRequest(View frame);

/// Takes a number from the front of `text`. Returns nothing if `text` begins with no digit, or with
/// more than `most` digits.
std::optional<std::uint32_t> TakeNumber(std::string_view& text, std::size_t most);

}  // namespace baudgate::protocols::spabus
