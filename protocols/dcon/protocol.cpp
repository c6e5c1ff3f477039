// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/protocol.h"

#include <algorithm>

#include "gateway/base/text.h"
#include "protocols/dcon/codec.h"
#include "protocols/dcon/commands.h"
#include "protocols/dcon/conversation.h"
#include "protocols/dcon/decode.h"
#include "protocols/dcon/frame_rule.h"
#include "protocols/dcon/settings.h"
#include "protocols/dcon/twin.h"

namespace baudgate::dcon {
namespace {

using config::Access;
using config::Point;
using config::Type;

Status CheckAddress(std::string_view address) {
  const auto parsed = ParseAddress(address);
  if (!parsed) return Error{parsed.error()};
  return {};
}

Status CheckReadType(const Point& point, const ReadAddress& read) {
  const bool bit = read.select == ReadAddress::Select::bit;
  if (bit != (point.type == Type::boolean)) {
    return Error{bit ? "read '" + point.read + "' is one bit: its type is bool"
                     : "read '" + point.read + "' is no bit; a bool needs one, as in \"$6[b0]\""};
  }
  if ((read.form == Form::text) != (point.type == Type::string)) {
    return Error{"read '" + point.read +
                 (read.form == Form::text ? "' gives text: its type is string(n)"
                                          : "' gives a number, not text")};
  }
  return {};
}

Status CheckWriteType(const Point& point, const WriteAddress& write) {
  if (point.type == Type::string) return Error{"text can not be written to a DCON output"};
  const bool bit = write.kind == WriteAddress::Kind::bit;
  if (bit != (point.type == Type::boolean)) {
    return Error{bit ? "write '" + point.write + "' sets one output: its type is bool"
                     : "write '" + point.write + "' takes a number; a bool is written by {bit}"};
  }
  return {};
}

Status CheckPoint(const Point& point) {
  if (point.access != Access::write) {
    const auto read = ParseRead(point.read);
    if (!read) return Error{read.error()};
    if (const Status status = CheckReadType(point, *read); !status) return status;
  }
  if (point.access == Access::read) return {};
  if (point.write.empty()) {
    return Error{
        "a writable point needs write:, as in write: \"#13{bit}\" or \"#2{+00.000 0..10}\""};
  }
  const auto write = ParseWrite(point.write);
  if (!write) return Error{write.error()};
  return CheckWriteType(point, *write);
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

/// Forms of the good reply, and of the refusal that every command may get.
std::vector<Shape> Shapes(const Command& command, bool checksum) {
  const std::size_t extra = checksum ? 4 : 2;  // lead, CR, checksum
  const auto form = DefaultForm(command.text);
  std::vector<Shape> shapes = {{'?', extra, extra + 2}};
  if (!form) {
    shapes.push_back({'>', extra, extra + 2});
    shapes.push_back({'!', extra, kMaxFrame});
    return shapes;
  }
  const bool several = command.text.starts_with("#") || command.text.starts_with("^");
  const bool data = *form == Form::numbers || *form == Form::number || *form == Form::words ||
                    *form == Form::bits;
  if (data) shapes.push_back({'>', extra + 4, kMaxFrame});
  if (!data || several) shapes.push_back({'!', extra + 2, kMaxFrame});
  return shapes;
}

std::unique_ptr<Bus> MakeBus(const config::Line&) { return std::make_unique<DconBus>(); }

std::unique_ptr<Twin> MakeTwin(const config::Device& device, TwinValues& values) {
  return std::make_unique<DconTwin>(device, values);
}

}  // namespace

Expectation Expect(View request, const config::Options& options) {
  const Settings settings = ReadSettings(options);
  Expectation expect;
  expect.max_bytes = kMaxFrame;
  expect.checksum = settings.checksum ? kChecksum : kNoChecksum;
  if (request.empty()) return expect;
  const auto command = ParseRequest(request, settings.checksum);
  if (!command) {
    expect.repeatable = false;
    return expect;
  }
  if (command->broadcast) {
    expect.reply = Expectation::Reply::none;
    expect.repeatable = false;
    return expect;
  }
  expect.checksum = ReplyVariant(command->text, settings);
  expect.repeatable = IsRepeatable(command->text);
  expect.shapes = Shapes(*command, settings.checksum);
  const auto form = DefaultForm(command->text);
  if (form == Form::text || form == Form::readback || form == Form::hex) {
    Append(expect.address, HexByte(ReplyAddress(*command)));
  }
  return expect;
}

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

}  // namespace baudgate::dcon
