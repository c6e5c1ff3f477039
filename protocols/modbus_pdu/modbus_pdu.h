// Rules of Modbus PDUs, function code and data, the same in every framing: codes, limits, lengths,
// and whether a reply fits its request. Source: MODBUS Application Protocol V1.1b3, 6 and 7. Used
// by the plugin protocols/modbus, by the server gateway/outputs/modbus and by queues of routed
// requests.
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
/// Set in the function code of an exception: 0x83 refuses function 3. So requests have 1…127.
inline constexpr std::uint8_t kExceptionBit = 0x80;
inline constexpr std::uint8_t kIdentification = 14;  ///< of kEncapsulated: the MEI type

enum ExceptionCode : std::uint8_t {
  kNoException = 0,
  kIllegalFunction = 1,  ///< function unknown, or not permitted
  kIllegalAddress = 2,   ///< not there, or read-only
  kIllegalValue = 3,     ///< count, limit, or a value that cannot be
  kDeviceFailure = 4,
  kAcknowledge = 5,
  kBusy = 6,
  kParityError = 8,
  kNoPath = 0x0A,    ///< of a gateway: there is no such unit
  kNoTarget = 0x0B,  ///< of a gateway: the device does not answer
};

inline constexpr std::size_t kMaxPdu = 253;  ///< function code included
/// The most values of one request.
inline constexpr std::size_t kMostRegisters = 125;
inline constexpr std::size_t kMostBits = 2000;
/// Registers of one record of a file: the reply has a byte count of at most F5.
inline constexpr std::size_t kMostOfFile = 121;
/// Entries of a queue of function 24.
inline constexpr std::size_t kMostQueued = 31;
inline constexpr std::size_t kMostWrittenRegisters = 123;
inline constexpr std::size_t kMostWrittenBits = 1968;
/// Functions 15 and 16 before their values: function, start, count, byte count.
inline constexpr std::size_t kWriteHeader = 6;
/// The good reply to functions 5, 6, 15 and 16: the first five bytes of its request.
inline constexpr std::size_t kWriteReply = 5;

/// 1…127: what may stand at the head of a request.
constexpr bool IsFunction(std::uint8_t code) { return code > 0 && code < kExceptionBit; }

// Whether a request is a write has four answers, each for its question:
//
//   request               03     08 00 00    08 00 01    06     16 (mask)   41 (unknown)
//   IsRead                yes    no          no          no     no          no
//   IsRepeatable          yes    yes         no          no     no          no
//   MayChangeSlave        no     no          yes         yes    yes         yes
//   IsPlainWrite          no     no          no          yes    no          no
//
// The queue of a line keeps the order of all but IsRead. What MayChangeSlave is recorded. What
// IsPlainWrite is permitted by `write` alone, and is a broadcast where it goes to unit 0.

/// 1…4: functions that only read, on any slave.
constexpr bool IsRead(std::uint8_t function) {
  return function >= kReadCoils && function <= kReadInput;
}
/// 15 and 16: of several coils or registers.
constexpr bool IsMultipleWrite(std::uint8_t function) {
  return function == kWriteCoils || function == kWriteRegisters;
}
/// 5, 6, 15 and 16: the writes that every Modbus device may know, and that unit 0 makes a
/// broadcast.
constexpr bool IsPlainWrite(std::uint8_t function) {
  return function == kWriteCoil || function == kWriteRegister || IsMultipleWrite(function);
}
/// Functions 1…6, 15 and 16: whether it is about coils or discrete inputs, not registers.
constexpr bool IsAboutBits(std::uint8_t function) {
  return function == kReadCoils || function == kReadDiscretes || function == kWriteCoil ||
         function == kWriteCoils;
}
/// The bytes that this many bits are packed into: 9 bits take 2.
constexpr std::size_t PackedSize(std::size_t bits) { return (bits + 7) / 8; }

/// A request of function 1…6, 15 or 16 taken apart. Views the PDU.
struct PlainRequest {
  Function function = kReadCoils;
  std::uint16_t start = 0;
  std::uint16_t count = 0;  ///< registers or bits; 1 for functions 5 and 6
  View data;                ///< functions 15 and 16: registers or packed bits; 5 and 6: two bytes
};
/// Fills `request` from a PDU, or says with which exception a slave refuses it: another function,
/// a count or length that the function does not have, a range beyond address 65535.
ExceptionCode ParseRequest(View pdu, PlainRequest& request);
/// Whether every slave answers the request, if only with an exception: ParseRequest accepts it.
bool IsCommon(View request);

/// The length of a PDU, as far as its first bytes show it.
struct PduLength {
  enum class Kind : std::uint8_t {
    exact,
    need_more,  ///< the byte that says it has not come yet
    unknown,    ///< only silence ends it
  };
  Kind kind = Kind::unknown;
  std::size_t size = 0;  ///< of exact; the function code counts
};
/// `head` is not empty. A count that contradicts itself makes the length unknown.
PduLength RequestLength(View head);
/// The length of a reply that says itself how long it is. `head` is not empty.
PduLength ReplyLength(View head);
/// It is as long as its function and byte count say, and registers have two bytes each. Most
/// requests, which an echo brings back, are no replies by that.
bool IsReplyForm(View pdu);
/// The length of the good reply to `request`; empty: it is not known, or no such reply can be.
std::optional<std::size_t> AwaitedLength(View request);
/// The length of the reply that begins with `head`; its Modbus TCP header counts `told`
/// bytes. Some servers count too many: where function and request fix the length, it is that,
/// unless the reply itself bears its header out.
std::size_t LengthOfReply(View request, View head, std::size_t told);
/// Whether the reply to this function code has its byte count in its second byte.
bool HasByteCount(std::uint8_t function);

/// Whether the request is harmless to repeat.
bool IsRepeatable(View request);
/// All functions but those that are known to read.
bool MayChangeSlave(View request);
/// Whether a good reply equals its request.
bool IsMirrored(View request);
/// False where no reply can equal its request: functions of which that is known. Some devices
/// confirm functions 15 and 16 with the whole request.
bool MayBeMirrored(std::uint8_t function);

struct Verdict {
  Outcome outcome = Outcome::ok;  ///< ok, refused (an exception) or unexpected
  std::string reason;             ///< empty when ok
  std::uint8_t exception = 0;     ///< of refused
};
/// Function, length, byte count, and what the reply repeats of its request. Of functions that are
/// not known any reply fits.
Verdict CheckReply(View request, View reply);

/// The PDU that refuses a request of this function: 83 02.
Bytes Exception(std::uint8_t function, std::uint8_t code);
/// "exception 02, illegal data address".
std::string ExceptionText(std::uint8_t code);

}  // namespace baudgate::modbus
