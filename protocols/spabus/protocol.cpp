// The descriptor of the SPA Bus protocol: options, decoders, times, checks and functions.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/protocol.h"

#include <algorithm>

#include "protocols/common/settings.h"
#include "protocols/spabus/codec.h"
#include "protocols/spabus/conversation.h"
#include "protocols/spabus/points.h"
#include "protocols/spabus/rules.h"
#include "protocols/spabus/settings.h"
#include "protocols/spabus/twin.h"

namespace baudgate::protocols::spabus {
namespace {

Result<std::string> CanonicalAddress(std::string_view address) {
  const auto slave = ParseSlave(address);
  if (!slave) return Error{slave.error()};
  return std::to_string(*slave);
}

/// The times of the bus. They are those of known masters (protocols/spabus/README.md names the
/// sources), because the chapter of the specification is not public.
constexpr TimingRule kTiming = {
    .quiet = {.least = 5ms, .characters = 5},
    .reply = {.least = 500ms},
    .gap = {.least = 50ms, .characters = 20},
    .drain = {.least = 100ms, .characters = 40},
    .longest = kMaxReply,
    .gaps = 0,
    // A reply may take ten seconds, or the time of two whole lines if this is longer, so that a
    // slow device does not block other devices for minutes. Sixteen lines take 4.3 s at 9600 bit/s.
    .longest_time = {.least = 10s, .characters = 2 * (kMaxLine + 2)}};

/// True if the point reads an S item, of the slave ("S21") or of a channel ("14S3").
bool IsSetting(const config::Point& point) {
  const std::string_view item = point.read;
  const std::size_t letter = item.find_first_not_of("0123456789");
  return letter < item.size() - 1 && item[letter] == 'S';
}

constexpr config::Traits kTraits = {
    .has_blocks = true, .speaks_text = true, .is_setting = IsSetting, .designation = "F"};

std::unique_ptr<Bus> MakeLine() { return std::make_unique<SpaBus>(); }

std::unique_ptr<Conversation> MakeDevice(const config::Device& device, const ParsedOptions& options,
                                         Bus* bus) {
  return MakeConversation(device, options.As<Settings>(), static_cast<SpaBus&>(*bus));
}

std::unique_ptr<Twin> MakeTwin(const config::Device& device, TwinValues& values) {
  return std::make_unique<SpaTwin>(device, values);
}

}  // namespace
}  // namespace baudgate::protocols::spabus

namespace baudgate::protocols {

using namespace protocols::spabus;  // NOLINT

const Protocol& SpabusProtocol() {
  static const Protocol kProtocol = {
      .name = "spabus",
      .title = "ABB SPA Bus, master",
      .also_called = "spa abb spa-bus",
      .options = OptionTable(),
      .decoders = DecoderTable(),
      .canonical_address = CanonicalAddress,
      .check_point = CheckPoint,
      .doubts = DoubtsOf,
      .serial = {.baud = 9600, .data_bits = 7, .parity = config::Parity::even},
      .timing = kTiming,
      .request_rule = RequestRule,
      .reply_rule = ReplyRule,
      .parse = ParseWith<ReadSettings>,
      .expect = kWithSettings<Expect>,
      .recognise = kWithSettings<Recognise>,
      .weak_check = true,
      .traits = kTraits,
      .scan = &kScan,
      .telegram = &kTelegram,
      .make_bus = MakeLine,
      .make_conversation = MakeDevice,
      .make_twin = MakeTwin,
  };
  return kProtocol;
}

}  // namespace baudgate::protocols
