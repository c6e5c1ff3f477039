// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/wire/request.h"

#include <algorithm>
#include <utility>

#include "protocols/assembler.h"

namespace baudgate::modbus {

namespace {

constexpr std::size_t kShortest = 2;  // bytes: unit and function
constexpr std::size_t kLongest = kMaxAdu - kMbapPrefix;

/// Returns why the received bytes cannot be the beginning of a frame; empty: they can be one.
std::string_view DefectOf(View held) {
  const ByteReader header(held);
  if (header.U16Be(2).value_or(0) != 0) return "protocol id is not 0";
  const std::size_t length = header.U16Be(4).value_or(kShortest);
  if (length < kShortest) return "length is too small for a function code";
  if (length > kLongest) return "length is above 254";
  return {};
}

}  // namespace

Bytes AduOf(std::uint16_t transaction, std::uint8_t unit, View pdu) {
  const std::size_t length = pdu.size() + 1;
  Bytes frame(kMbapHeader + pdu.size());
  frame[0] = static_cast<std::uint8_t>(transaction >> 8);
  frame[1] = static_cast<std::uint8_t>(transaction);
  frame[4] = static_cast<std::uint8_t>(length >> 8);
  frame[5] = static_cast<std::uint8_t>(length);
  frame[6] = unit;
  std::ranges::copy(pdu, frame.begin() + kMbapHeader);
  return frame;
}

std::span<std::uint8_t> MbapAssembler::Space() {
  if (begin_ > 0) {
    std::copy(buffer_.begin() + static_cast<std::ptrdiff_t>(begin_),
              buffer_.begin() + static_cast<std::ptrdiff_t>(end_), buffer_.begin());
    end_ -= begin_;
    begin_ = 0;
  }
  return std::span(buffer_).subspan(end_);
}

void MbapAssembler::Commit(std::size_t count) {
  end_ += std::min(count, kCapacity - end_);
  FindHeader();
}

std::string_view MbapAssembler::Defect() const {
  return surplus_ > 0 ? std::string_view() : DefectOf(Held());
}

std::size_t MbapAssembler::Size() const {
  const std::size_t told = kMbapPrefix + *ByteReader(Held()).U16Be(4);
  if (!length_ || Held().size() <= kMbapHeader) return told;
  return kMbapHeader + length_(Held(), told - kMbapHeader);
}

/// Searches for the next header after a frame that was shorter than its header announced. Skips
/// only bytes that cannot be the beginning of a header.
void MbapAssembler::FindHeader() {
  for (; surplus_ > 0; --surplus_, ++begin_) {
    if (Held().size() < kMbapPrefix) return;
    if (!DefectOf(Held()).empty()) continue;
    surplus_ = 0;
    return;
  }
}

MbapAssembler::State MbapAssembler::Peek() const {
  if (!Defect().empty()) return State::malformed;
  const bool header = surplus_ == 0 && Held().size() >= kMbapPrefix;
  return header && Held().size() >= Size() ? State::frame : State::need_more;
}

MbapAssembler::State MbapAssembler::Take(View& frame) {
  const State state = Peek();
  if (state == State::frame) {
    const std::size_t told = kMbapPrefix + *ByteReader(Held()).U16Be(4);
    frame = Held().first(Size());
    begin_ += frame.size();
    surplus_ = told - frame.size();
    FindHeader();
  }
  return state;
}

ExceptionCode ParseRequest(View frame, ModbusRequest& request) {
  request.frame = frame;
  request.unit = UnitOf(frame);
  return ParseRequest(PduOf(frame), static_cast<PlainRequest&>(request));
}

std::size_t ReplySize(const ModbusRequest& request) {
  return kMbapHeader + AwaitedLength(PduOf(request.frame)).value_or(0);
}

std::array<std::uint8_t, 9> ExceptionReply(View frame, ExceptionCode code) {
  const auto function = static_cast<std::uint8_t>(FunctionOf(frame) | kExceptionBit);
  return {frame[0], frame[1], 0, 0, 0, 3, UnitOf(frame), function, code};
}

namespace {

bool IsTcp(View heard) {
  MbapAssembler assembler;
  const auto space = assembler.Space();
  const std::size_t count = std::min(space.size(), heard.size());
  std::copy_n(heard.begin(), count, space.begin());
  assembler.Commit(count);
  View frame;
  if (assembler.Take(frame) != MbapAssembler::State::frame) return false;
  // Only functions with a known length are accepted, because six bytes of another protocol can look
  // like a header by chance.
  ModbusRequest request;
  return ParseRequest(frame, request) == kNoException;
}

bool HasRequest(View heard, const protocols::Protocol* protocol) {
  if (protocol == nullptr || protocol->carrier == nullptr) return false;
  protocols::Assembler assembler;
  assembler.Begin(protocol->request_rule, protocol->expect({}, {}));
  assembler.Feed(heard);
  while (const auto frame = assembler.Next(true)) {
    if (protocol->carrier->unwrap_request(*frame)) return true;
  }
  return false;
}

}  // namespace

std::optional<Framing> OtherFraming(View heard, Framing expected, const Frames& frames) {
  for (const Framing framing : {Framing::ascii, Framing::rtu, Framing::tcp}) {
    if (framing == expected) continue;
    if (framing == Framing::tcp ? IsTcp(heard) : HasRequest(heard, frames.Of(framing))) {
      return framing;
    }
  }
  return std::nullopt;
}

SerialFraming::SerialFraming(const protocols::Protocol& protocol) : carrier_(*protocol.carrier) {
  assembler_.Begin(protocol.request_rule, protocol.expect({}, {}));
}

std::span<std::uint8_t> SerialFraming::Space() {
  return std::span(buffer_).first(kCapacity - std::min(kCapacity, assembler_.held()));
}

void SerialFraming::Commit(std::size_t count) {
  assembler_.Feed(View(buffer_).first(std::min(count, kCapacity)));
  settled_ = false;
}

ClientFraming::State SerialFraming::Peek() {
  while (next_.empty()) {
    const auto whole = assembler_.Next(settled_);
    if (!whole) return State::need_more;
    const auto request = carrier_.unwrap_request(*whole);
    if (request) next_ = AduOf(0, request->first, request->second);
  }
  return State::frame;
}

ClientFraming::State SerialFraming::Take(View& frame) {
  const State state = Peek();
  if (state == State::frame) {
    taken_ = std::exchange(next_, {});
    frame = taken_;
  }
  return state;
}

void SerialFraming::Append(Bytes& out, View frame) const {
  baudgate::Append(out, View(carrier_.wrap(UnitOf(frame), PduOf(frame))));
}

std::unique_ptr<ClientFraming> MakeFraming(Framing framing, const Frames& frames) {
  if (const protocols::Protocol* protocol = frames.Of(framing)) {
    return std::make_unique<SerialFraming>(*protocol);
  }
  return std::make_unique<MbapFraming>();
}

}  // namespace baudgate::modbus
