// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/protocol.h"

#include <algorithm>

#include "protocols/option_specs.h"
#include "protocols/spabus/codec.h"
#include "protocols/spabus/conversation.h"
#include "protocols/spabus/frame_rule.h"
#include "protocols/spabus/options.h"
#include "protocols/spabus/twin.h"

namespace baudgate::spabus {
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

constexpr DecoderSpec kDecoders[] = {
    {"I1", "input data: measurements and digital inputs"},
    {"O1", "output data: starts, trips and relay outputs"},
    {"S1", "setting"},
    {"V1", "variable: recorded values, counters, control parameters"},
    {"M1", "memory data"},
    {"14V1", "item of channel 14; channel 0 may be left out"},
    {"C", "module status: 0 normal, 1 automatic reset, 2 event overflow, 3 both"},
    {"F", "type designation (string)"},
    {"T", "time within the minute, ss.sss"},
    {"D", "date and time (string)"},
    {"3A", "alarms of a channel (string)"},
};

/// What must not be written through a gateway, and why; nothing = it may be.
std::string_view Forbidden(const Address& address) {
  if (address.category != 'V') return {};
  switch (address.number.value_or(0)) {
    case 160:
    case 161:
      return "it is the password: set the option `password`, writes then use it by themselves";
    case 165:
      return "it sets off the self-supervision output";
    case 167:
      return "it formats the memory of the device";
    case 200:
      return "it changes the slave number and would make the device unreachable";
    case 201:
      return "it changes the bit rate and would make the device unreachable";
    default:
      return {};
  }
}

Status CheckRead(const config::Point& point) {
  const auto address = ParseAddress(point.read);
  if (!address) return Error{address.error()};
  const char category = address->category;
  if (category == 'L' || category == 'B') {
    return Error{"'" + point.read +
                 "' reads events, and reading takes them out of the device; "
                 "events are not points"};
  }
  const bool text = category == 'F' || category == 'D' || category == 'A';
  if (text && point.type != config::Type::string) {
    return Error{"'" + point.read + "' is text: use type string(16)"};
  }
  const std::uint32_t number = address->number.value_or(0);
  if (category == 'V' && number >= kPasswordItems.first && number <= kPasswordItems.last) {
    return Error{"'" + point.read + "' is the password and can not be read"};
  }
  return {};
}

Status CheckWrite(const config::Point& point) {
  const std::string& text = point.write.empty() ? point.read : point.write;
  const auto address = ParseAddress(text);
  if (!address) return Error{address.error()};
  constexpr std::string_view kWritable = "OSVMCTD";
  if (kWritable.find(address->category) == std::string_view::npos) {
    return Error{"'" + text + "' can only be read; the categories to write are O S V M C T D"};
  }
  const std::string_view why = Forbidden(*address);
  if (!why.empty()) {
    return Error{"'" + text + "' can not be written through the gateway: " + std::string(why)};
  }
  return {};
}

Status CheckAddress(std::string_view address) {
  const auto slave = ParseSlave(address);
  return slave ? Status() : Status(Error{slave.error()});
}

Status CheckPoint(const config::Point& point) {
  if (point.access != config::Access::write || !point.read.empty()) {
    if (Status read = CheckRead(point); !read) return read;
  }
  if (point.table == config::Table::bits && point.type != config::Type::boolean) {
    return Error{"'" + point.name + "' stands in a bit table: use type bool"};
  }
  if (point.access == config::Access::read) return {};
  return CheckWrite(point);
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

const Protocol& SpabusProtocol() {
  static const Protocol kProtocol = [] {
    Protocol protocol;
    protocol.name = "spabus";
    protocol.title = "ABB SPA Bus, master";
    protocol.options = kOptions;
    protocol.decoders = kDecoders;
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

}  // namespace baudgate::spabus
