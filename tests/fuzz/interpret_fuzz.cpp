// Fuzzes the decoding of one captured exchange.
// Input: device, options, a length byte and the request, then the reply in pieces
// (tests/fuzz/stream.h).
// SPDX-License-Identifier: Apache-2.0
#include <memory>

#include "protocols/assembler.h"
#include "tests/fuzz/devices.h"
#include "tests/fuzz/stream.h"
#include "tests/fuzz/under_test.h"

namespace baudgate::fuzz {
namespace {

void Interpret(protocols::Conversation& conversation, const config::Device& device, View request,
               const Stream& reply) {
  protocols::Assembler assembler;
  assembler.Begin(UnderTest().reply_rule,
                  UnderTest().expect(request, ParseOptions(UnderTest(), device.options)));
  assembler.Feed(reply.bytes);
  for (const bool idle : {false, true}) {
    while (const auto frame = assembler.Next(idle)) {
      const protocols::Answer answer = conversation.Interpret(request, *frame);
      CheckAnswer(answer, device);
      Require(answer.then == protocols::Then::done, "a captured exchange is no step of a task");
    }
  }
}

void FuzzInterpret(View bytes) {
  Input input(bytes);
  const std::uint8_t slice = input.U8();
  const config::Device& device = DeviceOf(slice, input.U8());
  const std::uint8_t head = input.U8();
  const View written = input.Take(head & 0x7FU);
  Bytes request(written.begin(), written.end());
  if ((head & 0x80U) != 0) Seal(UnderTest(), request, 0);
  if (UnderTest().name == "spabus" && !request.empty() && request.back() == '\n') {
    request.pop_back();  // an SPA request ends in CR only
  }
  const auto bus = MakeBus(UnderTest());
  const auto conversation = MakeConversation(UnderTest(), device, bus.get());
  Interpret(*conversation, device, request, TakeStream(UnderTest(), input));
}

const RegisteredFor kInterpret(Protocols::with_conversations, "interpret_", "", FuzzInterpret);

}  // namespace
}  // namespace baudgate::fuzz
