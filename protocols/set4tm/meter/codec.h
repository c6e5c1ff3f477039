// Pure functions on SET-4TM frames: addresses, checksums, and the lengths of requests and replies.
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
/// Largest data field of a reply of any known meter (type B). All buffers have this size.
inline constexpr std::size_t kMaxData = 156;
inline constexpr std::size_t kPasswordSize = 6;

/// The end of a frame: CRC-16, low byte first; or one byte KS in meters .01, and .02 with firmware
/// below 23 (reference, chapter 3). The values are those of Expectation::checksum.
enum class Checksum : std::uint8_t { crc, ks };
constexpr std::size_t SizeOf(Checksum checksum) { return checksum == Checksum::crc ? 2 : 1; }
constexpr Checksum Other(Checksum checksum) {
  return checksum == Checksum::crc ? Checksum::ks : Checksum::crc;
}
/// KS = FF xor all bytes. Example: FF for `00 00`.
void AppendChecksum(Bytes& bytes, Checksum checksum);
/// True if the frame ends with the checksum of the bytes before it, at least one byte.
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

/// Parameters of code 08 that the gateway itself needs.
enum Parameter : std::uint8_t {
  kSerialNumber = 0x00,
  kRatios = 0x02,
  kShortAddress = 0x05,
  kVariant = 0x12,
  kPort = 0x17,
  kFloats = 0x1B,
  kFloatMask = 0x23,
};

/// Returns the address bytes of "200" (C8), or of "9020001" or "sn:9020001" (FC 00 89 A2 61).
Result<Bytes> ParseAddress(std::string_view text);
/// Reverses ParseAddress: returns "200" or "sn:9020001".
std::string FormatAddress(View address);
Bytes ExtendedAddress(std::uint32_t number);
constexpr std::size_t AddressLength(std::uint8_t first) { return first == kExtendedPrefix ? 5 : 1; }

/// Accepts six characters, or "hex:01 02 03 04 05 06".
Result<Bytes> ParsePassword(std::string_view text);

Bytes MakeFrame(View address, View pdu, Checksum checksum = Checksum::crc);

/// Parts of a valid frame. The views refer to the bytes of the frame.
struct Parts {
  View address;
  View body;  ///< the PDU of a request; status or data of a reply
};
/// Returns nothing if the frame is too short or its checksum is wrong.
std::optional<Parts> SplitFrame(View frame, Checksum checksum = Checksum::crc);

/// The possible lengths of a request's PDU.
struct RequestLength {
  std::size_t min = 1;
  std::size_t max = 93;
  bool known = false;  ///< the reference lists the lengths; otherwise min and max are only limits
};
/// Returns the length by the first bytes of a PDU. Nothing: the second byte is needed but missing.
std::optional<RequestLength> LengthOfRequest(View pdu);

/// True for requests that are answered by one status byte alone: link test, channel, writes.
bool AnsweredByStatus(View pdu);
/// Returns the number of data bytes in a reply. Nothing: the reference does not define it.
std::optional<std::size_t> LengthOfData(View pdu);

}  // namespace baudgate::protocols::set4tm
