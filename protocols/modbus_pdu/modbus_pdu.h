// Rules of Modbus PDUs (function code and data), which are the same in every framing: codes,
// limits, lengths, and checks of replies against requests. Source: MODBUS Application Protocol
// V1.1b3, 6 and 7. Used by the plugin protocols/modbus, by the server gateway/outputs/modbus and by
// queues of routed requests.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "gateway/base/bytes.h"
#include "gateway/base/outcome.h"

namespace baudgate::modbus {

enum Function : std::uint8_t {
  kReadCoils = 1,
  kReadDiscretes = 2,
  kReadHolding = 3,
  kReadInput = 4,
  kWriteCoil = 5,
  kWriteRegister = 6,
  kExceptionStatus = 7,
  kDiagnostics = 8,
  kEventCounter = 11,
  kEventLog = 12,
  kWriteCoils = 15,
  kWriteRegisters = 16,
  kServerId = 17,
  kReadFile = 20,
  kMaskWrite = 22,
  kReadWrite = 23,
  kReadQueue = 24,
  kEncapsulated = 43,
};
/// The bit that an exception sets in the function code: 0x83 refuses function 3. So the function
/// codes of requests are 1…127.
inline constexpr std::uint8_t kExceptionBit = 0x80;
/// The MEI type of kEncapsulated that reads the device identification.
inline constexpr std::uint8_t kIdentification = 14;

enum ExceptionCode : std::uint8_t {
  kNoException = 0,
  kIllegalFunction = 1,  ///< the slave does not know the function, or does not permit it
  kIllegalAddress = 2,   ///< the address is absent or read-only
  kIllegalValue = 3,     ///< the count, length or value is invalid
  kDeviceFailure = 4,
  kAcknowledge = 5,
  kBusy = 6,
  kParityError = 8,
  kNoPath = 0x0A,    ///< sent by a gateway: there is no such unit
  kNoTarget = 0x0B,  ///< sent by a gateway: the device does not answer
};

inline constexpr std::size_t kMaxPdu = 253;  ///< maximum length, function code included
/// The maximum number of registers or bits in one read.
inline constexpr std::size_t kMostRegisters = 125;
inline constexpr std::size_t kMostBits = 2000;
/// The maximum number of registers in one record of a file, because the reply's byte count is at
/// most F5.
inline constexpr std::size_t kMostOfFile = 121;
/// The maximum number of entries in the queue that function 24 reads.
inline constexpr std::size_t kMostQueued = 31;
inline constexpr std::size_t kMostWrittenRegisters = 123;
inline constexpr std::size_t kMostWrittenBits = 1968;
/// Size of a request of function 15 or 16 in front of its values: function, start, count, byte
/// count.
inline constexpr std::size_t kWriteHeader = 6;
/// Size of the good reply to functions 5, 6, 15 and 16: it is the first five bytes of the request.
inline constexpr std::size_t kWriteReply = 5;

constexpr bool IsFunction(std::uint8_t code) { return code > 0 && code < kExceptionBit; }

// Four functions tell from a request whether it is a write, each for its own purpose:
//
//   request               03     08 00 00    08 00 01    06     16 (mask)   41 (unknown)
//   IsRead                yes    no          no          no     no          no
//   IsRepeatable          yes    yes         no          no     no          no
//   MayChangeSlave        no     no          yes         yes    yes         yes
//   IsPlainWrite          no     no          no          yes    no          no
//
// The queue of a line keeps the order of all requests for which IsRead is false. Requests for which
// MayChangeSlave is true are recorded. `permit: data` of a listener allows only requests for which
// IsRead or IsPlainWrite is true; a plain write to unit 0 is a broadcast.

/// True for functions 1…4, which read on every slave and change nothing.
constexpr bool IsRead(std::uint8_t function) {
  return function >= kReadCoils && function <= kReadInput;
}
constexpr bool IsMultipleWrite(std::uint8_t function) {
  return function == kWriteCoils || function == kWriteRegisters;
}
/// True for 5, 6, 15 and 16: the common writes. They are broadcasts if they are sent to unit 0.
constexpr bool IsPlainWrite(std::uint8_t function) {
  return function == kWriteCoil || function == kWriteRegister || IsMultipleWrite(function);
}
/// True if the function is for coils or discrete inputs, false for registers. Valid for functions
/// 1…6, 15 and 16.
constexpr bool IsAboutBits(std::uint8_t function) {
  return function == kReadCoils || function == kReadDiscretes || function == kWriteCoil ||
         function == kWriteCoils;
}
constexpr std::size_t PackedSize(std::size_t bits) { return (bits + 7) / 8; }

/// The parts of a request of function 1…6, 15 or 16. `data` is a view into the PDU.
struct PlainRequest {
  Function function = kReadCoils;
  std::uint16_t start = 0;
  std::uint16_t count = 0;  ///< number of registers or bits; 1 for functions 5 and 6
  /// Functions 15 and 16: the registers or packed bits to write; 5 and 6: the two bytes of the
  /// value.
  View data;
};
/// Fills `request` from a PDU. Returns the exception with which a slave refuses the PDU: unknown
/// function, invalid count or length, or a range beyond address 65535.
ExceptionCode ParseRequest(View pdu, PlainRequest& request);
/// True if every slave answers the request, at least with an exception. These are the requests that
/// ParseRequest accepts.
bool IsCommon(View request);

/// The length of a PDU, derived from its first bytes.
struct PduLength {
  enum class Kind : std::uint8_t {
    exact,
    need_more,  ///< the byte that gives the length has not come yet
    unknown,    ///< only silence ends the PDU
  };
  Kind kind = Kind::unknown;
  std::size_t size = 0;  ///< length of the PDU, function code included; valid for `exact`
};
/// Returns the length of the request that begins with `head`, which must not be empty. A byte count
/// that contradicts the quantity gives `unknown`.
PduLength RequestLength(View head);
/// Returns the length of the reply that begins with `head`, which must not be empty.
PduLength ReplyLength(View head);
/// True if `pdu` has the form of a reply: its length matches its function and byte count, and
/// register data has an even length. Most requests do not have this form, so an echo is recognised.
bool IsReplyForm(View pdu);
/// Returns the length of the good reply to `request`. Empty: the length is unknown, or there is no
/// good reply.
std::optional<std::size_t> AwaitedLength(View request);
/// Returns the length of the Modbus TCP reply that begins with `head`. `told`: its length according
/// to the header. Some servers count too many bytes there: if function and request define a shorter
/// length, that length is returned, unless the byte count in the reply, or the repeated request,
/// confirms `told`.
std::size_t LengthOfReply(View request, View head, std::size_t told);
/// True if the second byte of a reply with this function code is a byte count.
bool HasByteCount(std::uint8_t function);

bool IsRepeatable(View request);
/// True unless the request is known to only read.
bool MayChangeSlave(View request);
/// True if the good reply has the same bytes as the request.
bool IsMirrored(View request);
/// False for functions whose reply never has the same bytes as the request. True also for functions
/// 15 and 16, because some devices confirm them with the whole request.
bool MayBeMirrored(std::uint8_t function);

struct Verdict {
  Outcome outcome = Outcome::ok;
  std::string reason;
  std::uint8_t exception = 0;
};
/// Checks the function, length and byte count of the reply, and the parts that it must repeat from
/// its request. For an unknown function any reply is ok.
Verdict CheckReply(View request, View reply);

/// Returns the PDU of an exception: 83 02 refuses function 3 with code 02.
Bytes Exception(std::uint8_t function, std::uint8_t code);
std::string ExceptionText(std::uint8_t code);

}  // namespace baudgate::modbus
