// SPDX-License-Identifier: Apache-2.0
#include "tests/protocols/runs/lag_line.h"

#include <algorithm>
#include <array>
#include <map>

#include "gateway/base/text.h"
#include "protocols/dcon/codec.h"
#include "protocols/modbus/codec.h"
#include "protocols/modbus/points.h"
#include "tests/protocols/runs/birth_values.h"

namespace baudgate::protocols {
namespace {

constexpr std::size_t kMostFast = 12;
constexpr std::size_t kMostSlow = 6;
constexpr std::int64_t kSerial = 9'020'001;
constexpr std::int64_t kOtherSerial = 9'999'999;

std::string_view ProtocolOf(const LagCase& which) { return which.setup.protocol->name; }
bool IsModbus(std::string_view protocol) { return protocol.starts_with("modbus"); }

config::Point Alone(config::Point point, std::string read) {
  point.name += " alone";
  point.read = std::move(read);
  point.group = config::Group::fast;
  return point;
}

std::vector<config::Point> TwoOf(const LagCase& which, const std::vector<config::Point>& all) {
  const std::string_view protocol = ProtocolOf(which);
  const bool snapshot = which.setup.name == "Set4tmSnapshot";
  std::array<std::string, 2> reads = {"input 0", "input 200"};
  if (protocol == "spabus") reads = {"I1", "I3"};
  if (protocol == "dcon") reads = {"#0", "#1"};
  if (protocol == "set4tm") reads = {"08 1B 02 00 float_le@0", "08 1B 02 04 float_le@0"};
  if (snapshot) reads = {"05 00 00 energy@0", "05 40 00 energy@0"};
  const auto energy = std::ranges::find(all, reads[0], &config::Point::read);
  const config::Point& pattern = energy == all.end() ? all.front() : *energy;
  return {Alone(pattern, reads[0]), Alone(pattern, reads[1])};
}

std::vector<config::Point> ManyOf(const LagCase& which, const std::vector<config::Point>& all) {
  std::vector<config::Point> points;
  std::size_t fast = 0;
  std::size_t slow = 0;
  for (const config::Point& point : all) {
    std::size_t& count = point.group == config::Group::fast ? fast : slow;
    if (count == (point.group == config::Group::fast ? kMostFast : kMostSlow)) continue;
    ++count;
    points.push_back(point);
  }
  if (slow > 0) points.back().group = config::Group::once;
  const std::string_view protocol = ProtocolOf(which);
  if (protocol == "spabus") {
    const auto setting = std::ranges::find(points, "S1", &config::Point::read);
    if (setting != points.end()) setting->access = config::Access::read_write;
  } else if (IsModbus(protocol)) {
    points.push_back(Alone(all.front(), "holding 1000"));
    points.back().group = config::Group::slow;
    points.back().access = config::Access::read_write;
  }
  return points;
}

std::vector<config::Point> PointsOf(const LagCase& which, const std::vector<config::Point>& all) {
  std::vector<config::Point> able;
  for (config::Point point : all) {
    if (!BirthCode::CanTell(ProtocolOf(which), point)) continue;
    point.scale = 1;
    point.offset = 0;
    point.sentinels.clear();
    able.push_back(std::move(point));
  }
  if (which.queries == Queries::one) return {able.front()};
  return which.queries == Queries::two ? TwoOf(which, able) : ManyOf(which, able);
}

const config::Line& CachedLine(const Setup& setup) {
  static std::map<std::string, config::Line> lines;
  const auto found = lines.find(setup.name);
  return found != lines.end() ? found->second : lines[setup.name] = LineOf(setup);
}

Bytes SpaReply(std::string text) {
  std::uint8_t sum = 0;
  for (const char c : text) sum ^= static_cast<std::uint8_t>(c);
  return ToBytes(text + HexByte(sum) + "\r\n");
}

Bytes SpaIdentification(const config::Device& device, Proof proof) {
  return SpaReply("<" + device.address + (proof == Proof::refused ? "N:6:" : "D:ANOTHER RELAY:"));
}

Bytes DconIdentification(View request, const config::Device& device, Proof proof) {
  const std::string address(AsText(request).substr(1, 2));
  return protocols::dcon::BuildReply(
      proof == Proof::refused ? "?" + address : "!" + address + "OTHER",
      device.options.Flag("checksum"));
}

Bytes ModbusRefusal(std::string_view protocol, View request) {
  const auto framing = protocol == "modbus_rtu" ? protocols::modbus::Framing::rtu
                                                : protocols::modbus::Framing::ascii;
  const auto asked = protocols::modbus::Unwrap(framing, request);
  if (!asked) return {};
  const auto refused = static_cast<std::uint8_t>(asked->pdu[0] | 0x80U);
  return protocols::modbus::Wrap(framing, asked->slave, Bytes{refused, 1});
}

/// True if devices of the protocol can behave like this. A meter always answers; a relay answers at
/// least with NACK.
bool Has(const Setup& setup, Proof proof) {
  if (setup.protocol->name == "set4tm") return proof == Proof::answered;
  return setup.protocol->name != "spabus" || proof != Proof::silent;
}

}  // namespace

std::string LagCase::name() const {
  constexpr std::string_view kQueries[] = {"One", "Two", "Many"};
  constexpr std::string_view kProofs[] = {"Answered", "Refused", "Silent"};
  return setup.name + std::string(kQueries[static_cast<std::size_t>(queries)]) +
         std::string(kProofs[static_cast<std::size_t>(proof)]);
}

bool LagCase::CanProve() const {
  return setup.protocol->name != "dcon" || proof != Proof::silent || queries != Queries::two;
}

const std::vector<LagCase>& LagCases() {
  static const std::vector<LagCase> cases = [] {
    std::vector<LagCase> all;
    for (const Setup& setup : RealLines()) {
      for (const Queries queries : {Queries::one, Queries::two, Queries::many}) {
        for (const Proof proof : {Proof::answered, Proof::refused, Proof::silent}) {
          if (Has(setup, proof)) all.push_back({setup, queries, proof});
        }
      }
    }
    return all;
  }();
  return cases;
}

LagCase LagCaseOf(const std::string& line, Queries queries, Proof proof) {
  return {RealLine(line), queries, proof};
}

config::Line LagLineOf(const LagCase& which) {
  config::Line line = CachedLine(which.setup);
  std::int64_t serial = kSerial;
  for (config::Device& device : line.devices) {
    device.points = PointsOf(which, device.points);
    device.poll = 2s;
    device.slow = 10s;
    if (ProtocolOf(which) == "dcon") device.options.Set("identify", which.proof != Proof::silent);
    const bool asks_loopback = IsModbus(ProtocolOf(which)) && which.proof != Proof::silent;
    if (asks_loopback) device.options.Set("probe", "loopback");
    const bool checked = ProtocolOf(which) == "set4tm" && which.queries != Queries::two;
    if (checked && !device.address.starts_with("sn:")) device.options.Set("serial_number", serial);
    device.trust_order = !which.CanProve();
    ++serial;
  }
  return line;
}

config::Device StrangerOf(const LagCase& which, const config::Device& device, bool other_identity) {
  config::Device stranger = device;
  if (other_identity && ProtocolOf(which) == "set4tm") {
    stranger.options.Set("serial_number", kOtherSerial);
  }
  return stranger;
}

Naming NamingOf(const LagCase& which, const config::Device& device) {
  const std::string_view protocol = ProtocolOf(which);
  if (protocol == "set4tm") {
    // Only the meter with this serial number answers at the address "sn:9020077".
    const bool checked = which.queries != Queries::two && !device.address.starts_with("sn:");
    return checked ? Naming::demanded : Naming::none;
  }
  const bool named = !IsModbus(protocol) && which.proof == Proof::answered;
  return named ? Naming::learned : Naming::none;
}

bool IsIdentification(const LagCase& which, View request) {
  const std::string_view protocol = ProtocolOf(which);
  const std::string_view text = AsText(request);
  if (protocol == "spabus") return text.find("RF:") != std::string_view::npos;
  if (protocol == "dcon") return text.size() > 3 && text[0] == '$' && text[3] == 'M';
  if (!IsModbus(protocol)) return false;
  const auto framing = protocol == "modbus_rtu" ? protocols::modbus::Framing::rtu
                                                : protocols::modbus::Framing::ascii;
  const auto asked = protocols::modbus::Unwrap(framing, request);
  return asked && (asked->pdu[0] == 0x08 || asked->pdu[0] == 0x11 || asked->pdu[0] == 0x2B);
}

std::optional<Bytes> SayIdentification(const LagCase& which, const config::Device& device,
                                       View request, bool other_identity) {
  if (!IsIdentification(which, request)) return std::nullopt;
  const std::string_view protocol = ProtocolOf(which);
  if (which.proof == Proof::silent) return Bytes();
  if (which.proof == Proof::answered && !other_identity) return std::nullopt;
  if (protocol == "spabus") return SpaIdentification(device, which.proof);
  if (protocol == "dcon") return DconIdentification(request, device, which.proof);
  return which.proof == Proof::refused ? std::optional(ModbusRefusal(protocol, request))
                                       : std::nullopt;
}

std::optional<std::uint32_t> WritablePoint(const config::Device& device) {
  for (std::uint32_t i = 0; i < device.points.size(); ++i) {
    if (device.points[i].access == config::Access::read_write) return i;
  }
  return std::nullopt;
}

}  // namespace baudgate::protocols
