// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/expect.h"

#include "protocols/modbus/pdu.h"

namespace baudgate::protocols::modbus {
namespace {

constexpr std::size_t kExceptionPdu = 2;

void Allow(Expectation& expect, Framing framing, int tag, std::size_t least, std::size_t most) {
  expect.shapes.push_back({tag, FrameLength(framing, least), FrameLength(framing, most)});
}

Result<std::uint8_t> SlaveOf(std::string_view address) { return ParseAddress(address); }

template <Framing kFraming>
Bytes WrapPdu(std::uint8_t slave, View pdu) {
  return Wrap(kFraming, slave, pdu);
}

template <Framing kFraming>
Outcome UnwrapReply(View request, View frame, Bytes& pdu) {
  pdu.clear();
  const auto asked = Unwrap(kFraming, request);
  auto answer = Unwrap(kFraming, frame);
  if (!asked || !answer || asked->slave != answer->slave) return Outcome::unexpected;
  const Outcome outcome = CheckReply(asked->pdu, answer->pdu).outcome;
  if (outcome != Outcome::unexpected || answer->pdu[0] == asked->pdu[0]) {
    pdu = std::move(answer->pdu);
  }
  return outcome;
}

template <Framing kFraming>
std::optional<std::pair<std::uint8_t, Bytes>> UnwrapRequest(View frame) {
  auto adu = Unwrap(kFraming, frame);
  if (!adu || adu->slave > kLastSlave || adu->pdu[0] == 0 || adu->pdu[0] >= kExceptionBit) {
    return std::nullopt;
  }
  return std::pair(adu->slave, std::move(adu->pdu));
}

template <Framing kFraming>
constexpr PduCarrier kCarrier = {
    SlaveOf, WrapPdu<kFraming>, UnwrapReply<kFraming>, UnwrapRequest<kFraming>, IsCommon, kFraming};

}  // namespace

Expectation Expect(Framing framing, View request) {
  Expectation expect;
  expect.max_bytes = MaxFrame(framing);
  if (request.empty()) return expect;
  const auto adu = Unwrap(framing, request);
  if (!adu) return expect;
  const Bytes& pdu = adu->pdu;
  expect.address = {adu->slave};
  expect.repeatable = IsRepeatable(pdu);
  expect.mirrors = MayBeMirrored(pdu[0]);
  if (IsBroadcast(framing, adu->slave)) {
    expect.reply = Expectation::Reply::none;
    return expect;
  }
  Allow(expect, framing, TagOf(adu->transaction, pdu[0] | kExceptionBit), kExceptionPdu,
        kExceptionPdu);
  const int tag = TagOf(adu->transaction, pdu[0]);
  const auto awaited = AwaitedLength(pdu);
  if (!awaited) {
    Allow(expect, framing, tag, 1, kMaxPdu);
  } else if (*awaited <= kMaxPdu) {
    Allow(expect, framing, tag, *awaited, *awaited);
  }
  return expect;
}

const PduCarrier* Carrier(Framing framing) {
  if (framing == Framing::tcp) return nullptr;
  return framing == Framing::rtu ? &kCarrier<Framing::rtu> : &kCarrier<Framing::ascii>;
}

}  // namespace baudgate::protocols::modbus
