// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/protocol.h"

#include <algorithm>

#include "protocols/modbus/ascii_frame_rule.h"
#include "protocols/modbus/codec.h"
#include "protocols/modbus/conversation.h"
#include "protocols/modbus/expect.h"
#include "protocols/modbus/points.h"
#include "protocols/modbus/rtu_frame_rule.h"
#include "protocols/modbus/settings.h"
#include "protocols/modbus/twin.h"

namespace baudgate::protocols::modbus {
namespace {

Status CheckAddress(std::string_view address) {
  const auto parsed = ParseAddress(address);
  return parsed ? Status() : Status(Error{parsed.error()});
}

Status CheckDevice(const config::Device& device) {
  const auto texts = ParseTexts(device.options.Texts("texts"));
  if (!texts) return Error{texts.error()};
  for (const config::Point& point : device.points) {
    if (point.access == config::Access::write) continue;
    const auto place = ReadPlace(point);
    if (!place || place->form != Form::text) continue;
    if (texts->contains(place->texts)) continue;
    return Error{"point '" + point.name + "' reads '" + point.read + "', but 'texts' has no \"" +
                 place->texts + " CODE=TEXT\""};
  }
  return {};
}

template <Framing kFraming>
Expectation Expect(View request, const config::Options&) {
  return Expect(kFraming, request);
}

/// Silence of 3.5 characters, and 1.75 ms above 19200 bit/s (MODBUS over Serial Line
/// V1.02, 2.5.1.1). The gap covers what adapters and serial servers add.
template <Framing kFraming>
config::Timing DefaultTiming(const config::SerialSettings& serial) {
  const Duration character = serial.CharacterTime();
  config::Timing timing;
  timing.quiet = serial.baud > 19200 ? Duration(1750us) : character * 7 / 2;
  timing.reply = 500ms;
  timing.gap = std::max<Duration>(20 * character, 50ms);
  const auto longest = static_cast<int>(MaxFrame(kFraming));
  timing.ceiling = *timing.reply + longest * character + 2 * *timing.gap;
  timing.drain = std::max<Duration>(20 * character, 100ms);
  return timing;
}

template <Framing kFraming>
std::unique_ptr<Bus> MakeBus(const config::Line&) {
  return std::make_unique<ModbusBus>(kFraming);
}

template <Framing kFraming>
std::unique_ptr<Twin> MakeTwin(const config::Device& device, TwinValues& values) {
  return std::make_unique<ModbusTwin>(kFraming, device, values);
}

config::SerialSettings Serial(int baud, int data_bits) {
  config::SerialSettings serial;
  serial.baud = baud;
  serial.data_bits = data_bits;
  serial.parity = config::Parity::even;
  serial.stop_bits = 1;
  return serial;
}

template <Framing kFraming>
Protocol Describe(std::string_view name, std::string_view title,
                  const config::SerialSettings& serial) {
  constexpr bool kRtu = kFraming == Framing::rtu;
  return {
      .name = name,
      .title = title,
      .options = OptionTable(),
      .decoders = DecoderTable(),
      .check_address = CheckAddress,
      .check_point = CheckPoint,
      .check_device = CheckDevice,
      .serial = serial,
      .data_bits = serial.data_bits,
      .timing = DefaultTiming<kFraming>,
      .request_rule = kRtu ? RtuRequestRule : AsciiRequestRule,
      .reply_rule = kRtu ? RtuReplyRule : AsciiReplyRule,
      .expect = Expect<kFraming>,
      .carrier = &Carrier(kFraming),
      .profiles_of = kRtu ? "" : "modbus_rtu",
      .make_bus = MakeBus<kFraming>,
      .make_twin = MakeTwin<kFraming>,
  };
}

}  // namespace
}  // namespace baudgate::protocols::modbus

namespace baudgate {

using namespace protocols::modbus;  // NOLINT

const Protocol& ModbusRtuProtocol() {
  static const Protocol kProtocol =
      Describe<Framing::rtu>("modbus_rtu", "Modbus RTU, master", Serial(19200, 8));
  return kProtocol;
}

const Protocol& ModbusAsciiProtocol() {
  static const Protocol kProtocol =
      Describe<Framing::ascii>("modbus_ascii", "Modbus ASCII, master", Serial(9600, 7));
  return kProtocol;
}

}  // namespace baudgate
