// SPDX-License-Identifier: Apache-2.0
#include "protocols/reader/protocol.h"

#include "protocols/common/settings.h"
#include "protocols/reader/codec.h"
#include "protocols/reader/conversation.h"
#include "protocols/reader/points.h"
#include "protocols/reader/rules.h"
#include "protocols/reader/settings.h"
#include "protocols/reader/twin.h"

namespace baudgate::protocols {

using namespace protocols::reader;  // NOLINT

const Protocol& ReaderProtocol() {
  static const Protocol kProtocol = {
      .name = "reader",
      .title = "Readers of tags and bar codes, weighing indicators that send by themselves",
      .also_called = "rfid barcode scale",
      .options = OptionTable(),
      .decoders = DecoderTable(),
      .canonical_address = [](std::string_view address) -> Result<std::string> {
        if (address.empty()) return std::string(kNoAddress);
        const auto parsed = ParseAddress(address);
        if (!parsed) return Error{parsed.error()};
        return std::to_string(*parsed);
      },
      .check_point = CheckPoint,
      .check_device = CheckDevice,
      .serial = {.baud = 9600, .data_bits = 8},
      .data_bits = 7,
      .timing = {.quiet = {.least = 5ms},
                 .reply = {.least = 500ms},
                 .gap = {.least = 100ms, .characters = 4},
                 .drain = {.least = 100ms, .characters = 4},
                 .longest = 128},
      .request_rule = RequestRule,
      .reply_rule = MessageRule,
      .parse = ParseWith<ReadSettings>,
      .expect = kWithSettings<Expect>,
      .recognise = kWithSettings<Recognise>,
      .unasked = [](const config::Options&) { return true; },
      .never_old = true,
      .make_conversation = [](const config::Device& device, const ParsedOptions& options,
                              Bus*) -> std::unique_ptr<Conversation> {
        return std::make_unique<ReaderConversation>(device, options.As<Settings>());
      },
      .make_twin = [](const config::Device& device, TwinValues& values) -> std::unique_ptr<Twin> {
        return std::make_unique<ReaderTwin>(device, values);
      },
  };
  return kProtocol;
}

}  // namespace baudgate::protocols
