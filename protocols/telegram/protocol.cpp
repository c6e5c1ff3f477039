// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/protocol.h"

#include "protocols/common/settings.h"
#include "protocols/telegram/compile.h"
#include "protocols/telegram/conversation.h"
#include "protocols/telegram/description.h"
#include "protocols/telegram/faults.h"
#include "protocols/telegram/points.h"
#include "protocols/telegram/rules.h"
#include "protocols/telegram/twin.h"

namespace baudgate::protocols {

using namespace protocols::telegram;  // NOLINT

const Protocol& TelegramProtocol() {
  static const Protocol kProtocol = {
      .name = "telegram",
      .title = "Devices whose telegrams are described in YAML",
      .also_called = "ascii nmea nmea0183 scpi mt-sics sics generic stream streamdevice",
      .options = OptionTable(),
      .decoders = DecoderTable(),
      .describe = Compile,
      .canonical_address = CanonicalAddress,
      .check_point = CheckPoint,
      .raw_numbers = NumbersOf,
      .faults = FaultsOf,
      .doubts = DoubtsOf,
      .serial = {},  // the default is 9600 8N1
      .timing = {.quiet = {.least = 5ms},
                 .reply = {.least = 300ms},
                 .gap = {.least = 50ms, .characters = 20},
                 .drain = {.least = 100ms, .characters = 20},
                 .longest = 256},
      .request_rule = CutTelegram,
      .reply_rule = CutTelegram,
      .parse = ParseWith<ReadSettings>,
      .expect = kWithSettings<Expect>,
      .recognise = kWithSettings<Recognise>,
      .unasked =
          [](const config::Options& options) {
            const auto description = DescriptionOf(options);
            return description && description->listens();
          },
      .weak_check = true,
      .traits = {.has_modes = true},
      .telegram = &kAskRule,
      .make_conversation = [](const config::Device& device, const ParsedOptions& options,
                              Bus*) -> std::unique_ptr<Conversation> {
        return std::make_unique<TelegramConversation>(device, options.As<Settings>());
      },
      .make_twin = [](const config::Device& device, TwinValues& values) -> std::unique_ptr<Twin> {
        return std::make_unique<TelegramTwin>(device, values);
      },
  };
  return kProtocol;
}

}  // namespace baudgate::protocols
