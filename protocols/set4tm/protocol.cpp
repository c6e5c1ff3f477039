// The descriptor of the SET-4TM protocol: options, decoders, times, checks and functions.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/protocol.h"

#include <algorithm>

#include "protocols/common/clock.h"
#include "protocols/common/settings.h"
#include "protocols/set4tm/conversation.h"
#include "protocols/set4tm/meter/codec.h"
#include "protocols/set4tm/meter/latch.h"
#include "protocols/set4tm/meter/points.h"
#include "protocols/set4tm/meter/settings.h"
#include "protocols/set4tm/rules.h"
#include "protocols/set4tm/twin/twin.h"

namespace baudgate::protocols::set4tm {
namespace {

Result<std::string> CanonicalAddress(std::string_view address) {
  const auto parsed = ParseAddress(address);
  if (!parsed) return Error{parsed.error()};
  return FormatAddress(*parsed);
}

Status CheckClockCare(const config::Device& device, const Settings& settings) {
  constexpr Duration kLeast = 2s;
  constexpr Duration kMost = 120s;
  if (settings.correct_clock <= Duration::zero()) return {};
  if (settings.correct_clock < kLeast || settings.correct_clock > settings.correct_clock_most) {
    return Error{
        "correct_clock: write a time from 2s to correct_clock_most, or 0s to switch it off"};
  }
  if (settings.correct_clock_most > kMost) {
    return Error{
        "correct_clock_most: a meter's clock can be corrected by at most 120s; write 120s or less"};
  }
  if (!settings.time_zone) {
    return Error{"correct_clock: set the time zone of the meter's clock, as time_zone: \"+03:00\""};
  }
  const auto find = [&](std::string_view name) {
    return std::ranges::find(device.points, name, &config::Point::name);
  };
  const auto drift = find(kClockDriftPoint);
  const auto field = ParseField(drift != device.points.end() ? drift->read : "");
  if (!field || field->decoder != Decoder::drift || drift->scale != 1 || drift->offset != 0) {
    return Error{
        "correct_clock: the device needs a point clock_drift, with read: \"04 00 drift@0\" and "
        "neither scale nor offset"};
  }
  const auto correction = find(kClockCorrectionPoint);
  if (correction == device.points.end() || correction->write != kCorrectsClock ||
      correction->type != config::Type::boolean) {
    return Error{
        "correct_clock: the device needs a point clock_correction, with write: \"03 0B\", "
        "type: bool and access: w"};
  }
  if (!correction->writing.allowed || correction->writing.select) {
    return Error{
        "correct_clock: clock_correction must be in the device's 'write', as 'write: "
        "[clock_correction]', and have no 'select'"};
  }
  return {};
}

std::optional<Field> FieldOf(const config::Point& point) {
  const auto field = ParseField(point.read);
  return field ? std::optional(*field) : std::nullopt;
}

Status CheckLatch(const config::Device& device, const Settings& settings) {
  constexpr Duration kLeast = 1min;
  constexpr Duration kMost = 24h;
  if (settings.latch == Duration::zero()) {
    for (const config::Point& point : device.points) {
      const auto field = FieldOf(point);
      if (!field || field->decoder != Decoder::latched) continue;
      return Error{"'" + point.name +
                   "' reads the time of the latch, but latch is off; set latch: 15min at the "
                   "device, or remove the point"};
    }
    return {};
  }
  if (settings.latch < kLeast || settings.latch > kMost) {
    return Error{"latch: write a time from 1min to 24h, or 0s to switch it off"};
  }
  return {};
}

Status CheckDevice(const config::Device& device) {
  if (Status status = CheckSettings(device.options); !status) return status;
  const Settings settings = ReadSettings(device.options);
  if (Status status = CheckClockCare(device, settings); !status) return status;
  if (Status status = CheckLatch(device, settings); !status) return status;
  if (settings.load_profiles.empty() && settings.billing.empty()) return {};
  const std::string key = settings.load_profiles.empty() ? "billing" : "load_profile";
  if (!settings.time_zone) {
    return Error{key +
                 ": records carry the time of the meter's clock; set its time zone, as time_zone: "
                 "\"+03:00\""};
  }
  if (!device.events) {
    return Error{key +
                 ": records are stored with the events; write 'events: on' at the device, or "
                 "'events: {}' at the top level"};
  }
  return {};
}

std::vector<ConfigRemark> DoubtsOfRatios(const config::Device& device) {
  std::vector<ConfigRemark> doubts;
  const Scale scale = ReadSettings(device.options).scale();
  if (!scale.voltage_ratio && !scale.current_ratio) return doubts;
  for (std::size_t i = 0; i < device.points.size(); ++i) {
    const auto field = ParseField(device.points[i].read);
    if (!field || device.points[i].scale == 1) continue;
    const Measure measure = MeasureOf(*field);
    const bool converted = measure == Measure::float_voltage   ? scale.voltage_ratio.has_value()
                           : measure == Measure::float_current ? scale.current_ratio.has_value()
                                                               : measure == Measure::float_power;
    if (!converted) continue;
    doubts.push_back({i,
                      "has a scale, but voltage_ratio or current_ratio already multiplies it; "
                      "remove the scale or the ratio"});
  }
  return doubts;
}

/// Returns warnings: points that have a scale although a ratio multiplies them already, a latch
/// without latched points, and events without a time zone.
std::vector<ConfigRemark> Doubts(const config::Device& device) {
  std::vector<ConfigRemark> doubts = DoubtsOfRatios(device);
  const Settings settings = ReadSettings(device.options);
  const bool reads_latched = std::ranges::any_of(device.points, [](const config::Point& point) {
    const auto field = FieldOf(point);
    return field && ReadsLatched(field->pdu);
  });
  if (settings.latch > Duration::zero() && !reads_latched) {
    doubts.push_back(
        {kNoPoint, device.address +
                       " has `latch`, but no point reads a latched value; add points with read: "
                       "\"08 1B 01 rr ...\", \"08 1B 03 rr ...\" or \"08 14 rr ...\""});
  }
  if (device.events && !settings.time_zone) {
    doubts.push_back({kNoPoint, device.address + " has events, but no time zone for their times; "
                                                 "set time_zone, as time_zone: \"+03:00\""});
  }
  return doubts;
}

/// Silence of 7 characters ends a frame (8 ms at 9600 bit/s), and the meter answers within 100 ms
/// after it (reference, chapter 4). The gap covers delays of adapters and serial servers.
constexpr TimingRule kTiming = {.quiet = {.least = 4ms, .characters = 7},
                                .reply = {.least = 300ms, .characters = 14, .plus = 200ms},
                                .gap = {.least = 50ms, .characters = 7},
                                .drain = {.least = 150ms, .characters = 7, .plus = 100ms},
                                .longest = kMaxData + 7,
                                .gaps = 4};

std::unique_ptr<Bus> MakeLine() { return std::make_unique<MeterBus>(); }

std::unique_ptr<Conversation> MakeConversation(const config::Device& device,
                                               const ParsedOptions& options, Bus* bus) {
  return std::make_unique<MeterConversation>(device, options.As<Settings>(),
                                             dynamic_cast<MeterBus&>(*bus));
}

std::unique_ptr<Twin> MakeTwin(const config::Device& device, TwinValues& values) {
  return std::make_unique<MeterTwin>(device, values);
}

}  // namespace
}  // namespace baudgate::protocols::set4tm

namespace baudgate::protocols {

using namespace protocols::set4tm;  // NOLINT

const Protocol& Set4tmProtocol() {
  static const Protocol kProtocol = {
      .name = "set4tm",
      .title = "SET-4TM, PSCH-3/4TM, SEB-1TM electricity meters, master",
      .also_called = "mercury mercury230 merkury nzif psch seb",
      .options = OptionTable(),
      .decoders = DecoderSpecs(),
      .canonical_address = CanonicalAddress,
      .check_point = CheckPoint,
      .raw_numbers =
          [](const config::Device&, const config::Point& point) {
            const auto field = ParseField(point.read);
            return field ? NumbersOf(*field) : config::RawNumbers();
          },
      .check_device = CheckDevice,
      .doubts = Doubts,
      .serial = {.baud = 9600, .data_bits = 8, .parity = config::Parity::odd},
      .data_bits = 8,
      .timing = kTiming,
      .request_rule = RequestRule,
      .reply_rule = ReplyRule,
      .parse = ParseWith<ReadSettings>,
      .expect = kWithSettings<Expect>,
      .recognise = kWithSettings<Recognise>,
      .traits = {.common_address = "0"},
      .remembers = [](const config::Device&) { return true; },
      .scan = &kScan,
      .telegram = &kTelegram,
      .make_bus = MakeLine,
      .make_conversation = MakeConversation,
      .make_twin = MakeTwin,
  };
  return kProtocol;
}

}  // namespace baudgate::protocols
