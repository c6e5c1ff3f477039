// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/wire/client_framing.h"

#include <algorithm>
#include <utility>

#include "gateway/outputs/modbus/wire/request.h"
#include "protocols/assembler.h"

namespace baudgate::modbus {

namespace {

bool IsTcp(View heard) {
  MbapAssembler assembler;
  const auto space = assembler.Space();
  const std::size_t count = std::min(space.size(), heard.size());
  std::copy_n(heard.begin(), count, space.begin());
  assembler.Commit(count);
  View frame;
  if (assembler.Take(frame) != MbapAssembler::State::frame) return false;
  // Only functions whose length is known: six bytes of anything else have such a header, too.
  ModbusRequest request;
  return ParseRequest(frame, request) == kNoException;
}

bool HasRequest(View heard, const Protocol* protocol) {
  if (protocol == nullptr || protocol->carrier == nullptr) return false;
  Assembler assembler;
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

SerialFraming::SerialFraming(const Protocol& protocol) : carrier_(*protocol.carrier) {
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
  if (const Protocol* protocol = frames.Of(framing)) {
    return std::make_unique<SerialFraming>(*protocol);
  }
  return std::make_unique<MbapFraming>();
}

}  // namespace baudgate::modbus
