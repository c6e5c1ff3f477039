// The descriptors of Modbus RTU, ASCII and TCP: options, decoders, times, checks and functions.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/protocol.h"

#include <algorithm>

#include "protocols/common/settings.h"
#include "protocols/modbus/codec.h"
#include "protocols/modbus/conversation.h"
#include "protocols/modbus/points.h"
#include "protocols/modbus/recognise.h"
#include "protocols/modbus/rules.h"
#include "protocols/modbus/settings.h"
#include "protocols/modbus/twin.h"

namespace baudgate::protocols::modbus {
namespace {

template <Framing kFraming>
Result<std::string> CanonicalAddress(std::string_view address) {
  const auto parsed = ParseAddress(address, kFraming);
  if (!parsed) return Error{parsed.error()};
  return std::to_string(*parsed);
}

Status CheckDevice(const config::Device& device) {
  const auto texts = ParseTexts(device.options.Texts("texts"));
  if (!texts) return Error{texts.error()};
  const auto times = ParseReplyTimes(device.options.Texts("reply_times"));
  if (!times) return Error{times.error()};
  for (const config::Point& point : device.points) {
    if (point.access == config::Access::write) continue;
    const auto place = ReadLocation(point);
    if (!place || place->form != Form::text) continue;
    const std::string its = "point '" + point.name + "' reads '" + point.read + "', but ";
    const auto table = texts->find(place->texts);
    if (table == texts->end()) {
      return Error{its + "'texts' has no \"" + place->texts + " CODE=TEXT\"; add this entry"};
    }
    for (const auto& [code, text] : table->second) {
      if (text.size() <= point.text_length) continue;
      return Error{its + "'" + text + "' is longer than the point's type; write string(" +
                   std::to_string(text.size()) + ")"};
    }
  }
  return {};
}

template <Framing kFraming>
Expectation Expect(View request, const ParsedOptions&) {
  return protocols::modbus::Expect(kFraming, request);
}

template <Framing kFraming>
std::optional<std::vector<std::size_t>> ChangesFrame(View request, const config::Device& device) {
  const auto adu = Unwrap(kFraming, request);
  if (!adu) return std::nullopt;
  const auto slave = ParseAddress(device.address, kFraming);
  const bool is_meant = !slave || *slave == adu->slave || IsBroadcast(kFraming, adu->slave);
  return is_meant ? ChangedPoints(adu->pdu, device) : std::vector<std::size_t>();
}

template <Framing kFraming>
std::optional<Recognised> RecogniseAs(View request, View heard, const ParsedOptions&) {
  return Recognise(kFraming, request, heard);
}

/// Times on a serial line. Frames are separated by silence of 3.5 characters, 1.75 ms above 19200
/// bit/s (MODBUS over Serial Line V1.02, 2.5.1.1). The gap inside a frame covers the delays of
/// adapters and serial servers.
TimingRule Times(std::size_t longest) {
  return {.quiet = {.least = 1750us, .characters = 3.5},
          .reply = {.least = 500ms},
          .gap = {.least = 50ms, .characters = 20},
          .drain = {.least = 100ms, .characters = 20},
          .longest = longest};
}

/// Times on a TCP connection. If a TCP segment is lost, the sender repeats it after 200 ms or more
/// (RFC 6298, 2.4), so silences of 300 ms can occur inside a reply.
TimingRule TcpTimes() {
  return {.quiet = {.least = 100us},
          .reply = {.least = 1s},
          .gap = {.least = 300ms},
          .drain = {.least = 300ms},
          .longest = kMaxTcp};
}

config::RawNumbers RawNumbersOf(const config::Device&, const config::Point& point) {
  const auto place = ReadLocation(point);
  return place ? NumbersOf(*place) : config::RawNumbers();
}

std::unique_ptr<Bus> MakeTransactions() { return std::make_unique<Transactions>(); }

template <Framing kFraming>
std::unique_ptr<Conversation> MakeConversation(const config::Device& device,
                                               const ParsedOptions& options, Bus* bus) {
  return std::make_unique<ModbusConversation>(kFraming, device, options.As<Settings>(),
                                              static_cast<Transactions*>(bus));
}

template <Framing kFraming>
std::unique_ptr<Twin> MakeTwin(const config::Device& device, TwinValues& values) {
  return std::make_unique<ModbusTwin>(kFraming, device, values);
}

constexpr config::SerialSettings Serial(int baud, int data_bits) {
  return {.baud = baud, .data_bits = data_bits, .parity = config::Parity::even};
}

constexpr config::SerialSettings kNoSerial = {.baud = config::SerialSettings::kNoWire};

struct Rules {
  FrameRule request;
  FrameRule reply;
};

constexpr Rules RulesOf(Framing framing) {
  if (framing == Framing::tcp) return {TcpRequestRule, TcpReplyRule};
  if (framing == Framing::ascii) return {AsciiRequestRule, AsciiReplyRule};
  return {RtuRequestRule, RtuReplyRule};
}

constexpr config::Traits TraitsOf(Framing framing) {
  const bool tcp = framing == Framing::tcp;
  const bool ascii = framing == Framing::ascii;  // ASCII sends two characters per byte
  return {.service = tcp ? "Modbus TCP" : "",
          .counterpart = tcp ? "modbus_rtu" : "modbus_tcp",
          .has_blocks = true,
          .speaks_text = ascii,
          .has_byte_order = true,
          // Length of a reply with registers, without the registers. TCP: MBAP (7), function,
          // count. RTU: slave, function, count, CRC (2). ASCII: ':', slave, function, count and LRC
          // in two characters each, CR LF.
          .register_reply = {.around = tcp     ? 9U
                                       : ascii ? 11U
                                               : 5U,
                             .each = ascii ? 4U : 2U}};
}

template <Framing kFraming>
Protocol Describe(std::string_view name, std::string_view title,
                  const config::SerialSettings& serial) {
  constexpr bool kTcp = kFraming == Framing::tcp;
  return {
      .name = name,
      .title = title,
      .also_called = kFraming == Framing::ascii ? "" : "modbus",
      .options = OptionTable(),
      .decoders = DecoderTable(),
      .canonical_address = CanonicalAddress<kFraming>,
      .check_point = CheckPoint,
      .raw_numbers = RawNumbersOf,
      .check_device = CheckDevice,
      .serial = serial,
      .data_bits = serial.data_bits,
      .tcp = kTcp,
      .timing = kTcp ? TcpTimes() : Times(MaxFrame(kFraming)),
      .request_rule = RulesOf(kFraming).request,
      .reply_rule = RulesOf(kFraming).reply,
      .parse = ParseWith<ReadSettings>,
      .expect = Expect<kFraming>,
      .changes = ChangesFrame<kFraming>,
      .recognise = RecogniseAs<kFraming>,
      .foreign = kFraming == Framing::rtu ? ForeignRtu : nullptr,
      .weak_check = kFraming == Framing::ascii,
      .traits = TraitsOf(kFraming),
      .scan = ScanOf(kFraming),
      .telegram = TelegramOf(kFraming),
      .carrier = Carrier(kFraming),
      .profiles_of = kFraming == Framing::rtu ? "" : "modbus_rtu",
      .make_bus = kTcp ? MakeTransactions : nullptr,
      .make_conversation = MakeConversation<kFraming>,
      .make_twin = MakeTwin<kFraming>,
  };
}

}  // namespace
}  // namespace baudgate::protocols::modbus

namespace baudgate::protocols {

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

const Protocol& ModbusTcpProtocol() {
  static const Protocol kProtocol =
      Describe<Framing::tcp>("modbus_tcp", "Modbus TCP, client", kNoSerial);
  return kProtocol;
}

}  // namespace baudgate::protocols
