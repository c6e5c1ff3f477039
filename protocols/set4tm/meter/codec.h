// Functions on SET-4TM frames: addresses, checksums, and the lengths of requests and replies. They
// have no state and do no I/O.
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
/// Size of the largest data field in a reply of any known meter (type B). It limits all buffers.
inline constexpr std::size_t kMaxData = 156;
inline constexpr std::size_t kPasswordSize = 6;

/// The checksum at the end of a frame: CRC-16, low byte first; or one byte KS in meters .01, and
/// .02 with firmware below 23 (reference, chapter 3). The values are those of
/// Expectation::checksum.
enum class Checksum : std::uint8_t { crc, ks };
constexpr std::size_t SizeOf(Checksum checksum) { return checksum == Checksum::crc ? 2 : 1; }
constexpr Checksum Other(Checksum checksum) {
  return checksum == Checksum::crc ? Checksum::ks : Checksum::crc;
}
/// Appends the checksum of `bytes`. KS is FF xor all bytes. Example: FF for `00 00`.
void AppendChecksum(Bytes& bytes, Checksum checksum);
/// True if the frame ends with the checksum of the bytes before it; there must be at least one byte
/// before.
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

/// Returns the address bytes for a text: C8 for "200", FC 00 89 A2 61 for "9020001" or
/// "sn:9020001".
Result<Bytes> ParseAddress(std::string_view text);
/// Returns the text for an address that ParseAddress has made: "200" or "sn:9020001".
std::string FormatAddress(View address);
Bytes ExtendedAddress(std::uint32_t number);
constexpr std::size_t AddressLength(std::uint8_t first) { return first == kExtendedPrefix ? 5 : 1; }

/// Parses a password: six characters, or "hex:01 02 03 04 05 06".
Result<Bytes> ParsePassword(std::string_view text);

Bytes MakeFrame(View address, View pdu, Checksum checksum = Checksum::crc);

/// Parts of a valid frame. The views refer to the bytes of the frame.
struct Parts {
  View address;
  View body;  ///< the PDU of a request; status or data of a reply
};
/// Splits a frame into its parts. Returns nothing if the frame is too short or its checksum is
/// wrong.
std::optional<Parts> SplitFrame(View frame, Checksum checksum = Checksum::crc);

struct RequestLength {
  std::size_t min = 1;
  std::size_t max = 93;
  /// True: the reference defines min and max; false: they are only limits of this program.
  bool known = false;
};
/// Returns the length of a request by the first bytes of its PDU. Empty: the first bytes of `pdu`
/// are not enough.
std::optional<RequestLength> LengthOfRequest(View pdu);

/// True if a meter answers the request with a status byte and never with data: link test, channel,
/// writes.
bool AnsweredByStatus(View pdu);
/// Returns the number of data bytes in a reply. Empty: the reference does not define it.
std::optional<std::size_t> LengthOfData(View pdu);

}  // namespace baudgate::protocols::set4tm
