// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/scan.h"

#include <utility>

#include "gateway/base/text.h"
#include "protocols/modbus/named_places.h"
#include "protocols/modbus/pdu.h"
#include "protocols/modbus/space.h"

namespace baudgate::protocols::modbus {
namespace {

constexpr config::SerialSettings Format(int baud, int data_bits, config::Parity parity) {
  return {.baud = baud, .data_bits = data_bits, .parity = parity};
}
constexpr auto kNone = config::Parity::none;
constexpr auto kEven = config::Parity::even;
constexpr auto kOdd = config::Parity::odd;

constexpr config::SerialSettings kRtuSerials[] = {
    Format(9600, 8, kNone),  Format(19200, 8, kEven),       Format(9600, 8, kEven),
    Format(19200, 8, kNone), Format(115200, 8, kNone),      Format(38400, 8, kNone),
    Format(57600, 8, kNone), Format(38400, 8, kEven),       Format(115200, 8, kEven),
    Format(9600, 8, kOdd),   Format(19200, 8, kOdd),        Format(4800, 8, kNone),
    Format(2400, 8, kNone),  {.baud = 9600, .stop_bits = 2}};
constexpr config::SerialSettings kAsciiSerials[] = {Format(9600, 7, kEven), Format(19200, 7, kEven),
                                                    Format(9600, 8, kNone), Format(19200, 8, kNone),
                                                    Format(9600, 7, kOdd)};

constexpr ScanMode kModes[] = {{}};

enum Question : std::size_t { kServer, kObjects, kLoopback, kHolding, kInput, kCount };
/// No device counts these bytes among its own.
constexpr std::uint16_t kScanLoopback = 0xA537;

Bytes PduOf(std::size_t question) {
  switch (question) {
    case kServer:
      return {modbus::kServerId};
    case kObjects:
      return {kEncapsulated, kIdentification, kBasic, 0};
    case kLoopback:
      return LoopbackRequest(kScanLoopback);
    case kHolding:
      return ReadRequest(kReadHolding, 0, 1);
    default:
      return ReadRequest(kReadInput, 0, 1);
  }
}

template <Framing kFraming>
Bytes AskSlave(unsigned address, std::size_t, std::size_t question) {
  return Wrap(kFraming, static_cast<std::uint8_t>(address), PduOf(question));
}

void Tell(Sighting& sighting, const std::string& name) {
  if (!config::SpokenName(name).empty()) sighting.names.push_back(name);
}

/// What a good reply says beyond that somebody is there.
void TakeReply(View pdu, const Data& data, Sighting& sighting) {
  switch (pdu[0]) {
    case modbus::kServerId:
      if (data.texts.contains(0)) Tell(sighting, data.texts.at(0));
      break;
    case kEncapsulated: {
      const auto product = data.texts.find(kProduct);
      const auto vendor = data.texts.find(kVendor);
      if (product == data.texts.end()) break;
      if (vendor != data.texts.end()) Tell(sighting, vendor->second + " " + product->second);
      Tell(sighting, product->second);
      break;
    }
    case kReadHolding:
      sighting.point = "{ name: holding_0, read: holding 0, type: uint16, group: fast, modbus: 0 }";
      break;
    case kReadInput:
      sighting.point = "{ name: input_0, read: input 0, type: uint16, group: fast, modbus: 0 }";
      break;
    default:
      break;
  }
  if (!sighting.names.empty()) sighting.identity = Trim(sighting.names.front());
}

template <Framing kFraming>
Sighting JudgeSlave(View request, View frame, std::size_t) {
  Sighting sighting;
  const auto asked = Unwrap(kFraming, request);
  const auto reply = Unwrap(kFraming, frame);
  if (!asked || !reply || asked->slave != reply->slave) return sighting;
  const Verdict verdict = CheckReply(asked->pdu, reply->pdu);
  if (verdict.outcome == Outcome::unexpected) return sighting;
  const bool mirrored = asked->pdu == reply->pdu;
  sighting.what = mirrored ? Sighting::What::maybe : Sighting::What::device;
  if (verdict.outcome != Outcome::ok || mirrored) return sighting;
  if (const auto data = DataOf(asked->pdu, reply->pdu)) TakeReply(asked->pdu, *data, sighting);
  return sighting;
}

template <Framing kFraming>
ScanRule RuleOf(std::span<const config::SerialSettings> serials) {
  return {.serials = serials,
          .first_address = 1,
          .last_address = kLastSlave,
          .modes = kModes,
          .questions = kCount,
          // 03 00 is a write to a meter, whose frames have the same check value: nobody is asked
          // that has not answered as a Modbus slave.
          .finds = 1U << kServer | 1U << kObjects | 1U << kLoopback | 1U << kInput,
          .quick_finds = 1U << kServer | 1U << kInput,
          .never_at = kFraming == Framing::rtu ? "set4tm" : "",
          .usual = 80ms,
          .ask = AskSlave<kFraming>,
          .judge = JudgeSlave<kFraming>};
}

}  // namespace

const ScanRule* ScanOf(Framing framing) {
  static const ScanRule kRtu = RuleOf<Framing::rtu>(kRtuSerials);
  static const ScanRule kAscii = RuleOf<Framing::ascii>(kAsciiSerials);
  if (framing == Framing::tcp) return nullptr;
  return framing == Framing::rtu ? &kRtu : &kAscii;
}

}  // namespace baudgate::protocols::modbus
