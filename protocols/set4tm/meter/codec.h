// SET-4TM frames as pure functions: addresses, checksum, and how long requests and replies are.
// Bytes come from the conversation and the twin on their way to a line, and from frames cut there.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "gateway/base/bytes.h"
#include "gateway/base/result.h"

namespace baudgate::protocols::set4tm {

inline constexpr std::uint8_t kExtendedPrefix = 0xFC;
inline constexpr std::uint8_t kBroadcast = 0xFE;
inline constexpr std::uint8_t kCommonAddress = 0x00;
/// Largest reply data field of any known meter (type B); sizes every buffer.
inline constexpr std::size_t kMaxData = 156;
inline constexpr std::size_t kPasswordSize = 6;

/// What ends a frame: CRC-16, low byte first; in meters .01, and .02 with firmware below 23, one
/// byte KS (reference, chapter 3). The numbers are those of Expectation::checksum.
enum class Checksum : std::uint8_t { crc, ks };
constexpr std::size_t SizeOf(Checksum checksum) { return checksum == Checksum::crc ? 2 : 1; }
constexpr Checksum Other(Checksum checksum) {
  return checksum == Checksum::crc ? Checksum::ks : Checksum::crc;
}
/// KS = FF xor all bytes: FF for `00 00`.
void AppendChecksum(Bytes& bytes, Checksum checksum);
/// Whether the frame ends in the checksum of what is before, at least one byte.
bool EndsInChecksum(View frame, Checksum checksum);

/// Request codes, the first byte of a PDU.
enum Code : std::uint8_t {
  kLinkTest = 0x00,
  kOpenChannel = 0x01,
  kCloseChannel = 0x02,
  kWrite = 0x03,
  kJournal = 0x04,
  kEnergy = 0x05,
  kMemory = 0x06,
  kWriteMemory = 0x07,
  kRead = 0x08,
  kJournalExtended = 0x09,
  kEnergyExtended = 0x0A,
  kMemoryTagged = 0x0C,
};

/// Parameters of code 08 that the session itself uses.
enum Parameter : std::uint8_t {
  kSerialNumber = 0x00,
  kRatios = 0x02,
  kShortAddress = 0x05,
  kVariant = 0x12,
  kPort = 0x17,
  kFloats = 0x1B,
  kFloatMask = 0x23,
};

/// The address bytes of "200" (C8), "9020001" or "sn:9020001" (FC 00 89 A2 61).
Result<Bytes> ParseAddress(std::string_view text);
/// The reverse: "200", "sn:9020001".
std::string FormatAddress(View address);
Bytes ExtendedAddress(std::uint32_t number);
/// How long an address is that begins with `first`: 1, or 5 if that is the prefix FC.
constexpr std::size_t AddressLength(std::uint8_t first) { return first == kExtendedPrefix ? 5 : 1; }

/// Six characters as they stand, or "hex:01 02 03 04 05 06".
Result<Bytes> ParsePassword(std::string_view text);

/// address + PDU + checksum.
Bytes MakeFrame(View address, View pdu, Checksum checksum = Checksum::crc);

/// Views into a frame whose checksum is good.
struct Parts {
  View address;
  View body;  ///< the PDU of a request; status or data of a reply
};
/// Nothing when the frame is too short or its checksum is wrong.
std::optional<Parts> SplitFrame(View frame, Checksum checksum = Checksum::crc);

/// Lengths that the PDU of a request may have.
struct RequestLength {
  std::size_t min = 1;
  std::size_t max = 93;
  bool known = false;  ///< listed in the reference; otherwise min and max are only the limits
};
/// By the first byte or two of a PDU. Nothing when the second byte is needed and not there yet.
std::optional<RequestLength> LengthOfRequest(View pdu);

/// True for requests that are answered by one status byte alone: link test, channel, writes.
bool AnsweredByStatus(View pdu);
/// Data bytes of the reply to a read; nothing when the reference does not say.
std::optional<std::size_t> LengthOfData(View pdu);

}  // namespace baudgate::protocols::set4tm
