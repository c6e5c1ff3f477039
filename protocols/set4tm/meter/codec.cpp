// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/meter/codec.h"

#include <bit>
#include <string>

#include "gateway/base/text.h"

namespace baudgate::protocols::set4tm {
namespace {

/// Lengths for one parameter of code 08: of the request PDU, and of the data in the reply (0: the
/// length varies).
struct ParameterRow {
  std::uint8_t parameter;
  std::uint8_t min_request;
  std::uint8_t max_request;
  std::uint8_t data;
};

constexpr ParameterRow kParameters[] = {
    {0x00, 2, 2, 7}, {0x01, 2, 2, 2},   {0x02, 2, 2, 10}, {0x03, 2, 2, 3}, {0x04, 2, 3, 7},
    {0x05, 2, 3, 0}, {0x06, 2, 3, 2},   {0x09, 2, 3, 2},  {0x0A, 2, 3, 0}, {0x0B, 2, 2, 16},
    {0x0C, 2, 3, 8}, {0x0D, 2, 2, 16},  {0x0E, 2, 2, 7},  {0x11, 3, 3, 3}, {0x12, 2, 2, 3},
    {0x14, 3, 3, 0}, {0x16, 3, 3, 12},  {0x17, 2, 3, 2},  {0x18, 3, 3, 0}, {0x19, 2, 2, 7},
    {0x1B, 4, 4, 0}, {0x23, 12, 12, 0}, {0x24, 2, 2, 32},
};

const ParameterRow* FindParameter(std::uint8_t parameter) {
  for (const ParameterRow& row : kParameters) {
    if (row.parameter == parameter) return &row;
  }
  return nullptr;
}

RequestLength Exactly(std::size_t length) { return {length, length, true}; }

RequestLength LengthOfWrite(std::uint8_t parameter) {
  switch (parameter) {
    case 0x08:
      return Exactly(6);  // latch
    case 0x0B:
      return Exactly(4);  // clock correction
    case 0x0C:
      return Exactly(10);  // clock
    case 0x15:
      return Exactly(3);  // bit rate
    case 0x1B:
    case 0x1C:
      return Exactly(4);  // ratios
    default:
      return {2, 93, false};
  }
}

/// Returns the length of a record. Records with begin and end contain two times of 7 bytes, records
/// of single events one.
std::optional<std::size_t> LengthOfRecord(std::uint8_t journal) {
  switch (journal) {
    case 0x00:
      return 8;  // the clock, not a journal
    case 0x01:
    case 0x02:
    case 0x07:
    case 0x08:
    case 0x09:
    case 0x0A:
    case 0x3C:
      return 14;
    case 0x05:
    case 0x06:
      return 7;
    default:
      return std::nullopt;
  }
}

std::optional<std::size_t> LengthOfMaskedFloats(View pdu) {
  if (pdu.size() != 12) return std::nullopt;
  std::size_t values = 0;
  for (const std::uint8_t mask : pdu.subspan(5)) {
    values += static_cast<std::size_t>(std::popcount(mask));
  }
  const bool time = (pdu[4] & 0x80U) != 0;
  const std::size_t length = 1 + 4 * values + (time ? 8U : 0U);
  if (length < 5 || length > kMaxData) return std::nullopt;
  return length;
}

std::optional<std::size_t> LengthOfParameter(View pdu) {
  const std::uint8_t third = pdu.size() > 2 ? pdu[2] : 0;
  switch (pdu[1]) {
    case 0x05:
      return pdu.size() > 2 && third == 1 ? 4 : 2;
    case 0x0A:
      if (pdu.size() == 2) return 5;
      if (third == 1) return 32;
      return third == 2 || third == 3 ? std::optional<std::size_t>(4) : std::nullopt;
    case 0x14:
      if ((third & 0xF0U) == 0xF0U) return 16;
      return (third & 0xF0U) == 0x50U ? 7 : 3;
    case 0x18: {
      constexpr std::size_t kTaskStates[] = {5, 2, 2, 4};
      return third < 4 ? std::optional(kTaskStates[third]) : std::nullopt;
    }
    case kFloats:
      return third < 2 ? 4 : 16;
    case kFloatMask:
      return LengthOfMaskedFloats(pdu);
    default: {
      const ParameterRow* row = FindParameter(pdu[1]);
      return row == nullptr ? std::nullopt : std::optional<std::size_t>(row->data);
    }
  }
}

}  // namespace

Bytes ExtendedAddress(std::uint32_t number) {
  return {kExtendedPrefix, static_cast<std::uint8_t>(number >> 24),
          static_cast<std::uint8_t>(number >> 16), static_cast<std::uint8_t>(number >> 8),
          static_cast<std::uint8_t>(number)};
}

Result<Bytes> ParseAddress(std::string_view text) {
  const bool serial = text.starts_with("sn:");
  const auto number = ParseInteger<std::uint32_t>(serial ? text.substr(3) : text);
  if (!number) {
    return Error{"address \"" + std::string(text) +
                 "\" is not a SET-4TM address; write 0 to 239, or the serial number (sn:9020001)"};
  }
  if (serial || *number > 0xFF) return ExtendedAddress(*number);
  if (*number == kBroadcast) {
    return Error{
        "address 254 is the broadcast, which no meter answers; write the meter's own address, 1 to "
        "239"};
  }
  // 255 is the address of a meter after its factory initialisation.
  if (*number > 239 && *number != 255) {
    return Error{
        "address " + std::string(text) +
        " is reserved; write 0 to 239, or a serial number below 256 as sn:" + std::string(text)};
  }
  return Bytes{static_cast<std::uint8_t>(*number)};
}

std::string FormatAddress(View address) {
  if (address.size() == 1) return std::to_string(address[0]);
  std::uint32_t number = 0;
  for (const std::uint8_t byte : address.subspan(1)) number = number << 8U | byte;
  return "sn:" + std::to_string(number);
}

Result<Bytes> ParsePassword(std::string_view text) {
  constexpr std::string_view kHex = "hex:";
  if (text.starts_with(kHex)) {
    auto bytes = ParseHex(text.substr(kHex.size()));
    if (bytes && bytes->size() == kPasswordSize) return std::move(*bytes);
  } else if (text.size() == kPasswordSize) {
    return ToBytes(text);
  }
  return Error{"the password must be 6 ASCII characters, or 6 bytes as \"hex:01 02 03 04 05 06\""};
}

void AppendChecksum(Bytes& bytes, Checksum checksum) {
  if (checksum == Checksum::crc) return AppendCrc16(bytes);
  bytes.push_back(static_cast<std::uint8_t>(0xFFU ^ Xor8(bytes)));
}

bool EndsInChecksum(View frame, Checksum checksum) {
  if (checksum == Checksum::crc) return EndsInCrc16(frame);
  return frame.size() > 1 && Xor8(frame) == 0xFF;
}

Bytes MakeFrame(View address, View pdu, Checksum checksum) {
  Bytes frame(address.begin(), address.end());
  Append(frame, pdu);
  AppendChecksum(frame, checksum);
  return frame;
}

std::optional<Parts> SplitFrame(View frame, Checksum checksum) {
  if (frame.empty()) return std::nullopt;
  const std::size_t head = AddressLength(frame[0]);
  const std::size_t tail = SizeOf(checksum);
  if (frame.size() < head + 1 + tail || !EndsInChecksum(frame, checksum)) return std::nullopt;
  return Parts{frame.first(head), frame.subspan(head, frame.size() - head - tail)};
}

std::optional<RequestLength> LengthOfRequest(View pdu) {
  if (pdu.empty()) return std::nullopt;
  switch (pdu[0]) {
    case kLinkTest:
    case kCloseChannel:
      return Exactly(1);
    case kOpenChannel:
      return Exactly(1 + kPasswordSize);
    case kJournal:
      return Exactly(2);
    case kEnergy:
    case kJournalExtended:
      return Exactly(3);
    case kMemory:
      return Exactly(5);
    case kEnergyExtended:
    case kMemoryTagged:
      return Exactly(6);
    default:
      break;
  }
  if (pdu[0] != kRead && pdu[0] != kWrite) return RequestLength{};
  if (pdu.size() < 2) return std::nullopt;
  if (pdu[0] == kWrite) return LengthOfWrite(pdu[1]);
  const ParameterRow* row = FindParameter(pdu[1]);
  if (row == nullptr) return RequestLength{2, 93, false};
  return RequestLength{row->min_request, row->max_request, true};
}

bool AnsweredByStatus(View pdu) {
  return !pdu.empty() && (pdu[0] <= kWrite || pdu[0] == kWriteMemory);
}

std::optional<std::size_t> LengthOfData(View pdu) {
  const auto request = LengthOfRequest(pdu);
  if (!request || !request->known || pdu.size() < request->min || pdu.size() > request->max) {
    return std::nullopt;
  }
  // A reply with one data byte would look like a status, so memory reads of one byte have no length
  // here.
  const auto memory = [](std::size_t count, std::size_t tag) -> std::optional<std::size_t> {
    if (count < 2 || count + tag > kMaxData) return std::nullopt;
    return count + tag;
  };
  switch (pdu[0]) {
    case kJournal:
      return LengthOfRecord(static_cast<std::uint8_t>(pdu[1] >> 4));
    case kJournalExtended:
      return LengthOfRecord(pdu[1]);
    case kEnergy:
      return 16;
    case kEnergyExtended: {
      const auto values = static_cast<std::size_t>(std::popcount(pdu[4]));
      return values == 0 ? std::nullopt : std::optional(4 * values);
    }
    case kMemory:
      return memory(pdu[4], 0);
    case kMemoryTagged:
      return memory(pdu[5], 1);
    case kRead:
      return LengthOfParameter(pdu);
    default:
      return std::nullopt;
  }
}

}  // namespace baudgate::protocols::set4tm
