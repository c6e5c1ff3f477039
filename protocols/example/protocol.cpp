// SPDX-License-Identifier: Apache-2.0
#include "protocols/example/protocol.h"

#include "protocols/example/codec.h"
#include "protocols/example/conversation.h"
#include "protocols/example/points.h"
#include "protocols/example/rules.h"
#include "protocols/example/twin.h"

namespace baudgate::protocols {

using namespace protocols::example;  // NOLINT

const Protocol& ExampleProtocol() {
  static const Protocol kProtocol = {
      .name = "example",
      .title = "Example of the plugin guide",
      .decoders = DecoderTable(),
      .canonical_address = [](std::string_view address) -> Result<std::string> {
        const auto parsed = ParseAddress(address);
        if (!parsed) return Error{parsed.error()};
        return std::string(1, *parsed);
      },
      .check_point = CheckPoint,
      .serial = {.baud = 9600, .data_bits = 8},
      .timing = {.quiet = {.least = 5ms},
                 .reply = {.least = 200ms},
                 .gap = {.least = 20ms, .characters = 4},
                 .drain = {.least = 50ms, .characters = 4},
                 .longest = kMaxFrame},
      .request_rule = RequestRule,
      .reply_rule = ReplyRule,
      .expect = [](View request, const ParsedOptions&) { return Expect(request); },
      .make_conversation = [](const config::Device& device, const ParsedOptions&,
                              Bus*) -> std::unique_ptr<Conversation> {
        return std::make_unique<ExampleConversation>(device);
      },
      .make_twin = [](const config::Device& device, TwinValues& values) -> std::unique_ptr<Twin> {
        return std::make_unique<ExampleTwin>(device, values);
      },
  };
  return kProtocol;
}

}  // namespace baudgate::protocols
