// Modbus PDUs: function code and data, the same in both framings. Lengths, builders, and whether a
// reply fits its request. Requests come from conversation.cpp and from routes, replies from the
// frame rules.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/outcome.h"

namespace baudgate::protocols::modbus {

enum Function : std::uint8_t {
  kReadCoils = 1,
  kReadDiscretes = 2,
  kReadHolding = 3,
  kReadInput = 4,
  kWriteCoil = 5,
  kWriteRegister = 6,
  kDiagnostics = 8,
  kWriteCoils = 15,
  kWriteRegisters = 16,
  kMaskWrite = 22,
  kReadWrite = 23,
  kEncapsulated = 43,
};
inline constexpr std::uint8_t kExceptionBit = 0x80;
inline constexpr std::uint8_t kIdentification = 14;  ///< of kEncapsulated: the MEI type

inline constexpr std::size_t kMaxPdu = 253;
inline constexpr std::size_t kMostRegisters = 125;
inline constexpr std::size_t kMostBits = 2000;
inline constexpr std::size_t kMostWrittenRegisters = 123;
inline constexpr std::size_t kMostWrittenBits = 1968;

enum ExceptionCode : std::uint8_t {
  kIllegalFunction = 1,
  kIllegalAddress = 2,
  kIllegalValue = 3,
  kDeviceFailure = 4,
  kAcknowledge = 5,
  kBusy = 6,
  kNegative = 7,
  kParityError = 8,
  kNoPath = 0x0A,
  kNoTarget = 0x0B,
};

/// How long a PDU is, as far as its first bytes tell.
struct PduLength {
  enum class Kind : std::uint8_t {
    exact,
    need_more,  ///< the byte that says it has not come yet
    unknown,    ///< only silence ends it
  };
  Kind kind = Kind::unknown;
  std::size_t size = 0;
};

/// `head` is not empty. A count that contradicts itself makes the length unknown.
PduLength RequestLength(View head);
/// Of a reply that says itself how long it is, whatever was asked.
PduLength ReplyLength(View head);
/// Of the good reply to `request`; nothing: only silence ends it, or no such reply can be.
std::optional<std::size_t> AwaitedLength(View request);
/// Whether the reply to this function code has its byte count in its second byte.
bool HasByteCount(std::uint8_t function);

/// Whether every slave answers the request, if only with an exception: a read or write of coils or
/// registers (1-6, 15, 16) in which all is as the specification wants it.
bool IsCommon(View request);

/// Whether the request is harmless to repeat.
bool IsRepeatable(View request);
/// Whether a good reply equals its request.
bool IsMirrored(View request);
/// False where a good reply can not equal its request: functions of which that is known.
bool MayBeMirrored(std::uint8_t function);

struct Verdict {
  Outcome outcome = Outcome::ok;  ///< ok, refused (an exception) or unexpected
  std::string reason;
  std::uint8_t exception = 0;
};

/// Function, length, byte count, and what the reply repeats of its request.
Verdict CheckReply(View request, View reply);

/// "exception 02, illegal data address".
std::string ExceptionText(std::uint8_t code);

Bytes ReadRequest(std::uint8_t function, std::uint16_t address, std::size_t count);
Bytes WriteCoilRequest(std::uint16_t address, bool on);
Bytes WriteCoilsRequest(std::uint16_t address, const std::vector<bool>& bits);
Bytes WriteRegisterRequest(std::uint16_t address, std::uint16_t value);
Bytes WriteRegistersRequest(std::uint16_t address, const std::vector<std::uint16_t>& values);
Bytes MaskWriteRequest(std::uint16_t address, std::uint16_t keep, std::uint16_t set);
/// Sub-function 0: the device sends the same back.
Bytes LoopbackRequest(std::uint16_t data);
Bytes Exception(std::uint8_t function, std::uint8_t code);

void AppendU16(Bytes& to, std::size_t value);
/// Eight to a byte, the first in bit 0.
Bytes PackBits(const std::vector<bool>& bits);

}  // namespace baudgate::protocols::modbus
