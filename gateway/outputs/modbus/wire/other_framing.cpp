// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/wire/other_framing.h"

#include <algorithm>

#include "gateway/outputs/modbus/wire/mbap.h"
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

}  // namespace baudgate::modbus
