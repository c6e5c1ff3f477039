// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/protocol.h"

#include <algorithm>

#include "protocols/option_specs.h"
#include "protocols/spabus/codec.h"
#include "protocols/spabus/conversation.h"
#include "protocols/spabus/expect.h"
#include "protocols/spabus/frame_rule.h"
#include "protocols/spabus/points.h"
#include "protocols/spabus/settings.h"
#include "protocols/spabus/twin.h"

namespace baudgate::protocols::spabus {
namespace {

constexpr OptionSpec kOptions[] = {
    option::Integer(
        kMaxItems, "8", 1, 64,
        "Most items that one request reads together; 1 for devices that refuse ranges."),
    option::Secret(option::Integer(kPassword, "0", 0, 999,
                                   "Opened (V160) before and closed (V161) after each write; 0: "
                                   "the device needs none.")),
    option::Flag(kSendWildcard, "false",
                 "Send XX in place of the checksum: the device then checks nothing."),
    option::Flag(kAcceptWildcard, "true",
                 "Accept replies that carry XX in place of a checksum; false is safer where the "
                 "device never sends it."),
    option::Flag(kLineFeedInChecksum, "false",
                 "The device counts the line feed before '<' into the checksum of its replies."),
    option::Choice(kContinuation, "auto", "auto,a,b,c,d",
                   "What the checksum of a reply in several lines covers: a everything, b without "
                   "CR and LF, c also without &, d the last line only; auto learns it from the "
                   "replies."),
};

Status CheckAddress(std::string_view address) {
  const auto slave = ParseSlave(address);
  return slave ? Status() : Status(Error{slave.error()});
}

/// The spec's own chapter on delays is not public: figures of known masters, README.md says which.
config::Timing TimingOf(const config::SerialSettings& serial) {
  const Duration character = serial.CharacterTime();
  constexpr Duration kReply = 500ms;
  const Duration all_lines = character * static_cast<int>(kMaxReply);
  const Duration two_lines = character * static_cast<int>(2 * (kMaxLine + 2));
  config::Timing timing;
  timing.quiet = std::max<Duration>(5ms, character * 5);
  timing.reply = kReply;
  timing.gap = std::max<Duration>(50ms, character * 20);
  // Sixteen lines take 4.3 s at 9600 bit/s. On slow lines no device may hold the others up for
  // minutes: there the bound is ten seconds, or two whole lines where these take longer.
  timing.ceiling = kReply + std::min(all_lines, std::max<Duration>(10s, two_lines));
  timing.drain = std::max<Duration>(100ms, character * 40);
  return timing;
}

config::SerialSettings DefaultSerial() {
  config::SerialSettings serial;
  serial.baud = 9600;
  serial.data_bits = 7;
  serial.parity = config::Parity::even;
  serial.stop_bits = 1;
  return serial;
}

}  // namespace
}  // namespace baudgate::protocols::spabus

namespace baudgate {

using namespace protocols::spabus;  // NOLINT

const Protocol& SpabusProtocol() {
  static const Protocol kProtocol = [] {
    Protocol protocol;
    protocol.name = "spabus";
    protocol.title = "ABB SPA Bus, master";
    protocol.options = kOptions;
    protocol.decoders = DecoderTable();
    protocol.check_address = CheckAddress;
    protocol.check_point = CheckPoint;
    protocol.serial = DefaultSerial();
    protocol.timing = TimingOf;
    protocol.request_rule = RequestRule;
    protocol.reply_rule = ReplyRule;
    protocol.expect = Expect;
    protocol.make_bus = [](const config::Line&) -> std::unique_ptr<Bus> {
      return std::make_unique<SpaBus>();
    };
    protocol.make_twin = [](const config::Device& device,
                            TwinValues& values) -> std::unique_ptr<Twin> {
      return std::make_unique<SpaTwin>(device, values);
    };
    return protocol;
  }();
  return kProtocol;
}

}  // namespace baudgate
