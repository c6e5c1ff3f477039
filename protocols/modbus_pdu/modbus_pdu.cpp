// Lengths and checks of Modbus PDUs according to the MODBUS Application Protocol V1.1b3.
#include "protocols/modbus_pdu/modbus_pdu.h"

#include <algorithm>

#include "gateway/base/text.h"

namespace baudgate::modbus {
namespace {

using Kind = PduLength::Kind;

constexpr PduLength Exact(std::size_t size) { return {Kind::exact, size}; }
constexpr PduLength kNeedMore = {Kind::need_more, 0};
constexpr PduLength kUnknown = {Kind::unknown, 0};
constexpr std::uint16_t kCoilOn = 0xFF00;
constexpr std::size_t kException = 2;

/// True for the subfunctions of function 8 whose request and reply have two data bytes according to
/// the application protocol. Subfunction 0 (loopback) can have any number; other subfunctions
/// depend on the vendor.
bool HasTwoBytes(std::size_t diagnosis) {
  return (diagnosis >= 1 && diagnosis <= 4) || (diagnosis >= 10 && diagnosis <= 18) ||
         diagnosis == 20;
}

std::optional<std::size_t> CountAt(View pdu, std::size_t at) {
  const auto count = ByteReader(pdu).U16Be(at);
  return count ? std::optional<std::size_t>(*count) : std::nullopt;
}

/// Returns the length of a request that carries data. The byte count is at offset `at`, the
/// quantity in the two bytes before it.
PduLength WithData(View head, std::size_t at, bool bits) {
  if (head.size() <= at) return kNeedMore;
  const std::size_t quantity = CountAt(head, at - 2).value_or(0);
  const std::size_t count = head[at];
  if (count != (bits ? PackedSize(quantity) : 2 * quantity)) return kUnknown;
  return at + 1 + count <= kMaxPdu ? Exact(at + 1 + count) : kUnknown;
}

/// Returns the length of the reply to a device identification: 2B 0E, code, conformity, more
/// follows, next object, number of objects, then id, length and bytes of each object.
PduLength IdentificationLength(View head) {
  if (head.size() < 2) return kNeedMore;
  if (head[1] != kIdentification) return kUnknown;
  constexpr std::size_t kObjects = 7;
  if (head.size() < kObjects) return kNeedMore;
  std::size_t end = kObjects;
  for (unsigned object = 0; object < head[kObjects - 1]; ++object) {
    if (head.size() < end + 2) return end + 2 <= kMaxPdu ? kNeedMore : kUnknown;
    end += 2U + head[end + 1];
    if (end > kMaxPdu) return kUnknown;
  }
  return Exact(end);
}

bool RepeatsBegin(View request, View reply, std::size_t count) {
  return reply.size() >= count && request.size() >= count &&
         std::ranges::equal(reply.first(count), request.first(count));
}

Verdict Unexpected(std::string reason) { return {Outcome::unexpected, std::move(reason), 0}; }

/// True if the reply fits a request for one record of a file. Example: 14 05 05 06 0D FE 00 20. If
/// the request is for several records, only the length of the reply is checked.
bool IsOneRecord(View request, View reply) {
  if (request.size() != 9 || reply.size() < 4) return reply.size() >= 2;
  return reply[2] + 1U == reply[1] && reply[3] == request[2];
}

/// True for a whole reply of function 24 (18 hex): byte count, number of registers (two bytes
/// each), registers.
bool IsQueue(View reply) {
  const auto bytes = CountAt(reply, 1);
  const auto count = CountAt(reply, 3);
  return bytes && count && *count <= kMostQueued && *bytes == 2 + 2 * *count &&
         reply.size() == 3 + *bytes;
}

Verdict CheckRepeated(View request, View reply) {
  switch (request[0]) {
    case kWriteCoil:
    case kWriteRegister:
    case kMaskWrite:
      if (std::ranges::equal(reply, request)) return {};
      return Unexpected("the reply confirms another write: " + ToHex(reply));
    case kWriteCoils:
    case kWriteRegisters:
      if (RepeatsBegin(request, reply, 5)) return {};
      return Unexpected("the reply confirms another address or count: " + ToHex(reply));
    case kDiagnostics:
      if (!RepeatsBegin(request, reply, 3)) {
        return Unexpected("the reply is to another diagnostic request (function 08): " +
                          ToHex(reply));
      }
      if (!IsMirrored(request) || std::ranges::equal(reply, request)) return {};
      return Unexpected("the data of the loopback (function 08) came back changed: " +
                        ToHex(reply));
    case kEncapsulated:
      if (RepeatsBegin(request, reply, 2)) return {};
      return Unexpected("the reply is to another kind of function 2B request: " + ToHex(reply));
    case kReadFile:
      if (IsOneRecord(request, reply)) return {};
      return Unexpected("the reply is not the requested record of a file: " + ToHex(reply));
    case kReadQueue:
      if (IsQueue(reply)) return {};
      return Unexpected("the reply has not the form of a FIFO queue: " + ToHex(reply));
    default:
      return {};
  }
}

ExceptionCode ParseRead(ByteReader pdu, std::size_t most, PlainRequest& request) {
  const auto count = pdu.U16Be(3);
  if (pdu.size() != 5 || *count == 0 || *count > most) return kIllegalValue;
  request.count = *count;
  return kNoException;
}

ExceptionCode ParseSingleWrite(ByteReader pdu, PlainRequest& request) {
  const auto data = pdu.Slice(3, 2);
  if (pdu.size() != 5) return kIllegalValue;
  const std::uint16_t value = *pdu.U16Be(3);
  if (request.function == kWriteCoil && value != kCoilOn && value != 0) return kIllegalValue;
  request.count = 1;
  request.data = *data;
  return kNoException;
}

ExceptionCode ParseMultipleWrite(ByteReader pdu, std::size_t most, PlainRequest& request) {
  const auto count = pdu.U16Be(3);
  const auto bytes = pdu.U8(kWriteHeader - 1);
  if (!count || !bytes || *count == 0 || *count > most) return kIllegalValue;
  const std::size_t needed = IsAboutBits(request.function) ? PackedSize(*count) : 2U * *count;
  if (*bytes != needed || pdu.size() != kWriteHeader + needed) return kIllegalValue;
  request.count = *count;
  request.data = *pdu.Slice(kWriteHeader, needed);
  return kNoException;
}

ExceptionCode ParseByFunction(ByteReader pdu, PlainRequest& request) {
  switch (request.function) {
    case kReadCoils:
    case kReadDiscretes:
      return ParseRead(pdu, kMostBits, request);
    case kReadHolding:
    case kReadInput:
      return ParseRead(pdu, kMostRegisters, request);
    case kWriteCoil:
    case kWriteRegister:
      return ParseSingleWrite(pdu, request);
    case kWriteCoils:
      return ParseMultipleWrite(pdu, kMostWrittenBits, request);
    case kWriteRegisters:
      return ParseMultipleWrite(pdu, kMostWrittenRegisters, request);
    default:
      return kIllegalFunction;
  }
}

}  // namespace

bool HasByteCount(std::uint8_t function) {
  return IsRead(function) || function == kReadWrite || function == kEventLog ||
         function == kServerId || function == kReadFile;
}

PduLength RequestLength(View head) {
  switch (head[0]) {
    case kReadCoils:
    case kReadDiscretes:
    case kReadHolding:
    case kReadInput:
    case kWriteCoil:
    case kWriteRegister:
      return Exact(5);
    case kExceptionStatus:
    case kEventCounter:
    case kEventLog:
    case kServerId:
      return Exact(1);
    case kReadQueue:
      return Exact(3);
    case kReadFile:
      if (head.size() < 2) return kNeedMore;
      return head[1] % 7 == 0 && head[1] > 0 ? Exact(2U + head[1]) : kUnknown;
    case kDiagnostics:
      if (head.size() < 3) return kNeedMore;
      return HasTwoBytes(*CountAt(head, 1)) ? Exact(5) : kUnknown;
    case kWriteCoils:
      return WithData(head, 5, true);
    case kWriteRegisters:
      return WithData(head, 5, false);
    case kMaskWrite:
      return Exact(7);
    case kReadWrite:
      return WithData(head, 9, false);
    case kEncapsulated:
      if (head.size() < 2) return kNeedMore;
      return head[1] == kIdentification ? Exact(4) : kUnknown;
    default:
      return kUnknown;
  }
}

PduLength ReplyLength(View head) {
  if (head[0] >= kExceptionBit) return Exact(2);
  if (HasByteCount(head[0])) {
    if (head.size() < 2) return kNeedMore;
    return head[1] + 2U <= kMaxPdu ? Exact(head[1] + 2U) : kUnknown;
  }
  switch (head[0]) {
    case kWriteCoil:
    case kWriteRegister:
    case kWriteCoils:
    case kWriteRegisters:
      return Exact(5);
    case kMaskWrite:
      return Exact(7);
    case kExceptionStatus:
      return Exact(2);
    case kEventCounter:
      return Exact(5);
    case kReadQueue: {
      const auto bytes = CountAt(head, 1);
      if (!bytes) return kNeedMore;
      return *bytes >= 2 && *bytes <= 2 + 2 * kMostQueued ? Exact(3 + *bytes) : kUnknown;
    }
    case kEncapsulated:
      return IdentificationLength(head);
    default:
      return kUnknown;
  }
}

bool IsReplyForm(View pdu) {
  const bool registers = (IsRead(pdu[0]) || pdu[0] == kReadWrite) && !IsAboutBits(pdu[0]);
  if (registers && pdu.size() % 2 != 0) return false;
  const PduLength length = ReplyLength(pdu);
  if (length.kind == PduLength::Kind::unknown) return !HasByteCount(pdu[0]);
  return length.kind == PduLength::Kind::exact && length.size == pdu.size();
}

std::optional<std::size_t> AwaitedLength(View request) {
  if (request.empty()) return std::nullopt;
  const auto count = CountAt(request, 3);
  switch (request[0]) {
    case kReadCoils:
    case kReadDiscretes:
      if (!count || request.size() != 5) return std::nullopt;
      return 2 + PackedSize(*count);
    case kReadHolding:
    case kReadInput:
      if (!count || request.size() != 5) return std::nullopt;
      return 2 + 2 * *count;
    case kReadWrite:
      if (!count || request.size() < 10) return std::nullopt;
      return 2 + 2 * *count;
    case kDiagnostics: {
      const auto diagnosis = CountAt(request, 1);
      const bool known = diagnosis && (*diagnosis == 0 || HasTwoBytes(*diagnosis));
      return known && request.size() >= 5 ? std::optional(request.size()) : std::nullopt;
    }
    case kWriteCoil:
    case kWriteRegister:
    case kWriteCoils:
    case kWriteRegisters:
      return request.size() >= 5 ? std::optional<std::size_t>(5) : std::nullopt;
    case kMaskWrite:
      return request.size() == 7 ? std::optional<std::size_t>(7) : std::nullopt;
    case kExceptionStatus:
      return 2;
    case kEventCounter:
      return 5;
    case kReadFile: {
      const auto registers = CountAt(request, 7);
      if (!registers || request.size() != 9) return std::nullopt;
      return 4 + 2 * *registers;
    }
    default:
      return std::nullopt;
  }
}

std::size_t LengthOfReply(View request, View head, std::size_t told) {
  if (head.empty()) return told;
  if (head[0] >= kExceptionBit) return std::min(told, kException);
  if (request.empty() || head[0] != request[0]) return told;
  const std::size_t awaited = std::min(told, AwaitedLength(request).value_or(told));
  if (HasByteCount(head[0])) {
    return head.size() >= 2 && head[1] + std::size_t{2} == awaited ? awaited : told;
  }
  // Some devices confirm a write with the whole request, so the length of the request is accepted,
  // too.
  return told == request.size() ? told : awaited;
}

ExceptionCode ParseRequest(View pdu, PlainRequest& request) {
  if (pdu.empty()) return kIllegalFunction;
  request.function = static_cast<Function>(pdu[0]);
  request.start = ByteReader(pdu).U16Be(1).value_or(0);
  const ExceptionCode exception = ParseByFunction(ByteReader(pdu), request);
  if (exception != kNoException) return exception;
  return request.start + request.count > 0x10000 ? kIllegalAddress : kNoException;
}

bool IsCommon(View request) {
  PlainRequest parts;
  return ParseRequest(request, parts) == kNoException;
}

bool IsMirrored(View request) {
  if (request.empty()) return false;
  if (request[0] == kDiagnostics) return CountAt(request, 1) == std::size_t{0};
  return request[0] == kWriteCoil || request[0] == kWriteRegister || request[0] == kMaskWrite;
}

bool MayBeMirrored(std::uint8_t function) {
  constexpr std::uint8_t kNever[] = {kReadCoils, kReadDiscretes,   kReadHolding,  kReadInput,
                                     kReadWrite, kEncapsulated,    kEventLog,     kServerId,
                                     kReadQueue, kExceptionStatus, kEventCounter, kReadFile};
  return std::ranges::find(kNever, function) == std::end(kNever);
}

bool IsRepeatable(View request) {
  if (request.empty()) return false;
  if (request[0] == kDiagnostics) {
    // Not repeatable: subfunction 1 restarts the port, 4 silences the device, 10 and 20 clear
    // counters that other masters read.
    const auto sub = CountAt(request, 1);
    return sub && *sub != 1 && *sub != 4 && *sub != 10 && *sub != 20;
  }
  if (request[0] == kEncapsulated) return request.size() > 1 && request[1] == kIdentification;
  constexpr std::uint8_t kHarmless[] = {kExceptionStatus, kEventCounter, kEventLog,
                                        kServerId,        kReadFile,     kReadQueue};
  return IsRead(request[0]) || std::ranges::find(kHarmless, request[0]) != std::end(kHarmless);
}

bool MayChangeSlave(View request) {
  constexpr std::uint8_t kReads[] = {kExceptionStatus, kEventCounter, kEventLog,
                                     kServerId,        kReadFile,     kReadQueue};
  if (request[0] == kEncapsulated) return request.size() < 2 || request[1] != kIdentification;
  if (request[0] == kDiagnostics) {
    // Read-only subfunctions: 0 is a loopback, 2 reads the diagnostic register, 11 to 18 read
    // counters.
    const std::size_t what = CountAt(request, 1).value_or(1);
    return what != 0 && what != 2 && (what < 11 || what > 18);
  }
  return !IsRead(request[0]) && std::ranges::find(kReads, request[0]) == std::end(kReads);
}

Verdict CheckReply(View request, View reply) {
  if (request.empty() || reply.empty()) return Unexpected("the message has no function code");
  if (reply[0] == (request[0] | kExceptionBit) && request[0] < kExceptionBit) {
    if (reply.size() != 2) return Unexpected("the exception has the wrong length: " + ToHex(reply));
    return {Outcome::refused, ExceptionText(reply[1]), reply[1]};
  }
  if (reply[0] != request[0]) {
    return Unexpected("the reply has function " + HexByte(reply[0]) + ", not " +
                      HexByte(request[0]));
  }
  const auto awaited = AwaitedLength(request);
  if (awaited && reply.size() != *awaited) {
    return Unexpected(std::to_string(reply.size()) + " bytes came instead of " +
                      std::to_string(*awaited));
  }
  if (HasByteCount(reply[0]) && (reply.size() < 2 || reply[1] + 2U != reply.size())) {
    return Unexpected("the byte count contradicts the length of the reply");
  }
  return CheckRepeated(request, reply);
}

std::string ExceptionText(std::uint8_t code) {
  constexpr std::string_view kTexts[] = {
      "",
      "illegal function",
      "illegal data address",
      "illegal data value",
      "device failure",
      "request accepted, but not completed yet",
      "device busy",
      "negative acknowledge",
      "memory parity error",
      "",
      "the Modbus gateway before the device has no path to the device",
      "the device behind a gateway does not answer"};
  std::string text = "exception " + HexByte(code);
  if (code < std::size(kTexts) && !kTexts[code].empty()) {
    text += ", ";
    text += kTexts[code];
  }
  return text;
}

Bytes Exception(std::uint8_t function, std::uint8_t code) {
  return {static_cast<std::uint8_t>(function | kExceptionBit), code};
}

}  // namespace baudgate::modbus
