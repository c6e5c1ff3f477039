// Requests of the SPA Bus as text: addresses of items, the frames that ask for them, and the way
// back. Bytes go to the line from the conversation, and come from it to the twin. Wire format:
// README.md.
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
/// Nobody answers a request to this slave number.
inline constexpr unsigned kBroadcast = 900;
/// Most characters of a line that we make, of one that we take (devices older than version 2.1 of
/// the protocol send 256), and most lines of a continued reply that we take.
inline constexpr std::size_t kMaxLine = 255;
inline constexpr std::size_t kLongestLine = 256;
inline constexpr std::size_t kMaxLines = 16;
/// Most digits of a channel, and of a number of data or an event.
inline constexpr std::size_t kChannelDigits = 3;
inline constexpr std::size_t kNumberDigits = 6;
/// The checksum that says "do not check me".
inline constexpr std::string_view kWildcard = "XX";

constexpr bool IsDigit(char c) { return c >= '0' && c <= '9'; }
/// Printable ASCII, the only characters besides CR and LF that stand on the bus.
constexpr bool IsPrintable(std::uint8_t byte) { return byte >= 0x20 && byte <= 0x7E; }
/// Delimiters of the protocol; never inside a value.
constexpr bool IsReserved(char c) {
  return c == '<' || c == '>' || c == ':' || c == '/' || c == '&';
}

/// First and last, both included.
struct Range {
  std::uint32_t first = 0;
  std::uint32_t last = 0;
  std::size_t Count() const { return static_cast<std::size_t>(last) - first + 1; }
  bool operator==(const Range&) const = default;
};

/// One item of a slave: "I1", "14V1", "F".
struct Address {
  unsigned channel = 0;  ///< 0…999
  char category = 'I';
  std::optional<std::uint32_t> number;  ///< 0…999999; only of categories that count their items
  auto operator<=>(const Address&) const = default;
};

/// I, O, S, V, M are numbered; C, F, T, D, A, L, B are one item each.
bool TakesNumber(char category);

/// `[channel]category[number]`; the channel is 0 when left out. An error says what would be right.
Result<Address> ParseAddress(std::string_view text);
std::string FormatAddress(const Address& address);

/// 1…999 without 900. An error says what would be right.
Result<unsigned> ParseSlave(std::string_view text);

/// What a request says.
struct Command {
  unsigned slave = 0;
  bool write = false;
  Range channels;
  char category = 'I';
  std::optional<Range> numbers;
  std::string data;  ///< of a write
  bool operator==(const Command&) const = default;

  std::size_t ItemCount() const { return channels.Count() * (numbers ? numbers->Count() : 1); }
};

Command ReadOf(unsigned slave, const Address& first, std::uint32_t last_number);
Command WriteOf(unsigned slave, const Address& address, std::string data);

/// The whole frame, CR included. `wildcard`: XX in place of the checksum.
Bytes Encode(const Command& command, bool wildcard);

/// What a slave can make of a frame between `>` and CR.
struct ReceivedRequest {
  std::optional<unsigned> slave;   ///< empty: not even a slave number can be read
  bool intact = false;             ///< the checksum fits, or is XX
  std::optional<Command> command;  ///< empty: the syntax is wrong
  std::size_t data_at = 0;         ///< where Command::data begins in the frame
};
ReceivedRequest ParseRequest(View frame);

/// Takes up to `most` digits from the front; nothing when there is none or one more follows.
std::optional<std::uint32_t> TakeNumber(std::string_view& text, std::size_t most);

}  // namespace baudgate::protocols::spabus
