// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/protocol.h"

#include <algorithm>

#include "protocols/dcon/codec.h"
#include "protocols/dcon/conversation.h"
#include "protocols/dcon/expect.h"
#include "protocols/dcon/frame_rule.h"
#include "protocols/dcon/points.h"
#include "protocols/dcon/settings.h"
#include "protocols/dcon/twin.h"

namespace baudgate::protocols::dcon {
namespace {

using config::Access;
using config::Point;
using config::Type;

Status CheckAddress(std::string_view address) {
  const auto parsed = ParseAddress(address);
  if (!parsed) return Error{parsed.error()};
  return {};
}

/// One text with two meanings, of which only the first would ever be seen.
Status CheckCodes(const Settings& settings) {
  const std::pair<const char*, const std::vector<std::string>&> lists[] = {
      {"over", settings.over}, {"under", settings.under}, {"open", settings.open}};
  for (std::size_t i = 0; i < std::size(lists); ++i) {
    for (std::size_t j = i + 1; j < std::size(lists); ++j) {
      for (const std::string& code : lists[j].second) {
        if (std::ranges::find(lists[i].second, code) == lists[i].second.end()) continue;
        return Error{"'" + code + "' stands in '" + lists[i].first + "' and in '" + lists[j].first +
                     "'; it can mean one of them only"};
      }
    }
  }
  return {};
}

Status CheckDevice(const config::Device& device) {
  const Settings settings = ReadSettings(device.options);
  if (Status status = CheckCodes(settings); !status) return status;
  for (const Point& point : device.points) {
    const auto read = ParseRead(point.read);
    const bool indexed = read && read->select == ReadAddress::Select::index;
    if (settings.channels == 0 || !indexed || read->index < settings.channels) continue;
    return Error{"point '" + point.name + "' reads '" + point.read +
                 "', but 'channels: " + std::to_string(settings.channels) + "' ends at [" +
                 std::to_string(settings.channels - 1) + "]"};
  }
  return {};
}

config::Timing DefaultTiming(const config::SerialSettings& serial) {
  const Duration character = serial.CharacterTime();
  config::Timing timing;
  timing.quiet = 5ms;
  timing.reply = 300ms;
  timing.gap = std::max<Duration>(20 * character, 50ms);
  // The longest frame that there is, with a pause in it.
  timing.ceiling = *timing.reply + static_cast<int>(kMaxFrame) * character + 2 * *timing.gap;
  timing.drain = std::max<Duration>(20 * character, 100ms);
  return timing;
}

std::unique_ptr<Bus> MakeBus(const config::Line&) { return std::make_unique<DconBus>(); }

std::unique_ptr<Twin> MakeTwin(const config::Device& device, TwinValues& values) {
  return std::make_unique<DconTwin>(device, values);
}

}  // namespace
}  // namespace baudgate::protocols::dcon

namespace baudgate {

using namespace protocols::dcon;  // NOLINT

const Protocol& DconProtocol() {
  static const Protocol protocol = [] {
    Protocol p;
    p.name = "dcon";
    p.title = "DCON (ICP DAS, Advantech ADAM ASCII, OWEN), master";
    p.options = OptionTable();
    p.decoders = DecoderTable();
    p.check_address = CheckAddress;
    p.check_point = CheckPoint;
    p.check_device = CheckDevice;
    p.serial = {};  // 9600 8N1, the factory setting of most modules
    p.timing = DefaultTiming;
    p.request_rule = RequestRule;
    p.reply_rule = ReplyRule;
    p.expect = Expect;
    p.make_bus = MakeBus;
    p.make_twin = MakeTwin;
    return p;
  }();
  return protocol;
}

}  // namespace baudgate
