// The descriptor of the SET-4TM protocol: options, decoders, times, and the functions behind them.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/protocol.h"

#include <algorithm>

#include "protocols/option_specs.h"
#include "protocols/set4tm/codec.h"
#include "protocols/set4tm/conversation.h"
#include "protocols/set4tm/expect.h"
#include "protocols/set4tm/frame_rule.h"
#include "protocols/set4tm/points.h"
#include "protocols/set4tm/twin.h"

namespace baudgate::protocols::set4tm {
namespace {

constexpr double kLongNumber = 4294967295.0;

constexpr OptionSpec kOptions[] = {
    option::Secret(
        option::Text("password", "000000",
                     "Password of the channel: 6 ASCII characters, or hex:01 02 03 04 05 06.")),
    option::Integer("serial_number", "0", 0, kLongNumber,
                    "The meter that must answer: checked after every reconnect, and accepted as "
                    "extended address of replies; 0: not checked."),
    option::Integer("meter_constant", "0", 0, 1'000'000,
                    "Impulses per kWh (A) for energy; 0: ask the meter."),
    option::Real("voltage_ratio", "0", 0, 100'000,
                 "Voltage transformer ratio (Kn) in place of the meter's, for energy and integer "
                 "values; 0: ask the meter."),
    option::Real("current_ratio", "0", 0, 100'000,
                 "Current transformer ratio (Kt) in place of the meter's, for energy and integer "
                 "values; 0: ask the meter."),
    option::Real("power_coefficient", "0", 0, 1000,
                 "Coefficient Kc of integer powers; 0: by the meter's build variant."),
    option::Real("current_coefficient", "0", 0, 1000,
                 "Coefficient Ci of integer currents; 0: by the meter's build variant."),
    option::Flag("snapshot", "false",
                 "Read float values together by mask (08 23); falls back to 08 1B on status 01."),
};

Status CheckAddress(std::string_view address) {
  const auto parsed = ParseAddress(address);
  return parsed ? Status() : Status(Error{parsed.error()});
}

Status CheckDevice(const config::Device& device) {
  const auto password = ParsePassword(device.options.Text("password"));
  return password ? Status() : Status(Error{password.error()});
}

/// Reference, chapter 4: silence of 7 characters ends a frame (8 ms at 9600); the meter answers
/// within 100 ms behind it. The gap covers what adapters and serial servers add.
config::Timing DefaultTiming(const config::SerialSettings& serial) {
  const Duration character = serial.CharacterTime();
  config::Timing timing;
  timing.quiet = std::max<Duration>(4ms, 7 * character);
  timing.reply = std::max<Duration>(300ms, 200ms + 2 * *timing.quiet);
  timing.gap = std::max<Duration>(50ms, 7 * character);
  const auto longest = static_cast<int>(kMaxData) + 7;
  timing.ceiling = *timing.reply + longest * character + 4 * *timing.gap;
  timing.drain = std::max<Duration>(150ms, *timing.quiet + 100ms);
  return timing;
}

config::SerialSettings FactorySettings() {
  config::SerialSettings serial;
  serial.baud = 9600;
  serial.data_bits = 8;
  serial.parity = config::Parity::odd;
  serial.stop_bits = 1;
  return serial;
}

}  // namespace
}  // namespace baudgate::protocols::set4tm

namespace baudgate {

using namespace protocols::set4tm;  // NOLINT

const Protocol& Set4tmProtocol() {
  static const Protocol kProtocol = {
      .name = "set4tm",
      .title = "SET-4TM, PSCH-3/4TM, SEB-1TM electricity meters, master",
      .options = kOptions,
      .decoders = DecoderSpecs(),
      .check_address = CheckAddress,
      .check_point = CheckPoint,
      .check_device = CheckDevice,
      .serial = FactorySettings(),
      .data_bits = 8,
      .timing = DefaultTiming,
      .request_rule = RequestRule,
      .reply_rule = ReplyRule,
      .expect = Expect,
      .make_bus = MakeBus,
      .make_twin = MakeTwin,
  };
  return kProtocol;
}

}  // namespace baudgate
