// SPDX-License-Identifier: Apache-2.0
#include "config/lines.h"

#include <algorithm>
#include <array>

#include "config/catalog/option_values.h"
#include "config/checks/line_checks.h"
#include "config/checks/uniques.h"
#include "config/devices.h"
#include "config/events.h"
#include "config/files.h"
#include "config/modbus.h"
#include "config/model/network.h"
#include "config/points.h"
#include "config/profile.h"
#include "gateway/base/decimal.h"
#include "gateway/base/text.h"

namespace baudgate::config {

std::optional<std::string> ReadName(MapReader& map, std::string_view example) {
  const auto node = map.Need("name", example);
  if (!node) return std::nullopt;
  auto name = ReadText(*node, "name", map.problems());
  if (!name) return std::nullopt;
  if (const Status status = CheckName(*name); !status) {
    map.problems().Error(node->mark(), "name: " + status.error());
    return std::nullopt;
  }
  map.Rename(map.what() + " '" + *name + "'");
  return name;
}

namespace {

/// The parity that a word of the key `parity` means. Empty: the word `software`, which leaves the
/// parity as it is and lets the gateway make it.
using MapParity = std::optional<Parity>;
constexpr MapParity kSoftware;
constexpr std::array<Word<MapParity>, 11> kParities = {{{"none", Parity::none},
                                                        {"even", Parity::even},
                                                        {"odd", Parity::odd},
                                                        {"mark", Parity::mark},
                                                        {"space", Parity::space},
                                                        {"N", Parity::none},
                                                        {"E", Parity::even},
                                                        {"O", Parity::odd},
                                                        {"M", Parity::mark},
                                                        {"S", Parity::space},
                                                        {"software", kSoftware}}};
constexpr std::array<Word<bool>, 2> kWhoMakesParity = {{{"hardware", false}, {"software", true}}};

Rs485 ReadRs485(const YamlNode& node, Rs485 rs485, Problems& problems) {
  MapReader map(node, "rs485", problems);
  rs485.enabled = true;
  map.ReadAll(rs485);
  map.Finish();
  CheckRs485(rs485, map.keys(), problems);
  return rs485;
}

Timing ReadTiming(const YamlNode& node, Problems& problems) {
  Timing timing;
  MapReader map(node, "timing", problems);
  map.ReadAll(timing);
  map.Finish();
  CheckTiming(timing, map.MarkOf("ceiling"), problems);
  return timing;
}

}  // namespace

Result<SerialSettings> ParseSerial(std::string_view text, SerialSettings base) {
  const Error error{Quoted(text) +
                    " is not a bit rate with a character format; write for example 9600 8N1"};
  const std::string_view trimmed = Trim(text);
  const auto blank = trimmed.find(' ');
  if (blank == std::string_view::npos) return error;
  if (const std::string why = WhyLeadingZero(trimmed.substr(0, blank)); !why.empty()) {
    return Error{Quoted(text) + ": its bit rate " + why};
  }
  const auto baud = ParseInteger<int>(trimmed.substr(0, blank));
  const std::string_view form = Trim(trimmed.substr(blank));
  if (!baud || form.size() != 3) return error;
  const auto parity = ParityOf(form[1]);
  const bool known_data = form[0] == '7' || form[0] == '8';
  const bool known_stop = form[2] == '1' || form[2] == '2';
  if (!parity || !known_data || !known_stop) return error;
  if (*baud < kSlowestBaud || *baud > kFastestBaud) {
    return Error{std::to_string(*baud) + " baud is out of range; allowed: 300…921600"};
  }
  base.baud = *baud;
  base.data_bits = form[0] - '0';
  base.parity = *parity;
  base.stop_bits = form[2] - '0';
  return base;
}

SerialSettings ReadSerial(const YamlNode& node, const SerialSettings& base, Problems& problems) {
  SerialSettings serial = base;
  if (node.kind() == YamlNode::Kind::scalar) {
    const auto parse = [&](const std::string& text) { return ParseSerial(text, base); };
    return ReadParsed(node, "serial", problems, parse).value_or(base);
  }
  MapReader map(node, "serial", problems);
  map.Read<&SerialSettings::baud, &SerialSettings::data_bits, &SerialSettings::stop_bits,
           &SerialSettings::software_parity>(serial);
  if (const auto parity = map.OneOf("parity", kParities)) {
    if (*parity) serial.parity = **parity;
    if (!*parity) serial.software_parity = true;
  }
  map.Read<&SerialSettings::rtscts, &SerialSettings::xonxoff, &SerialSettings::low_latency>(serial);
  if (const auto rs485 = map.Get("rs485")) serial.rs485 = ReadRs485(*rs485, serial.rs485, problems);
  map.Finish();
  CheckSoftwareParity(serial, map.MarkOf("parity"), problems);
  CheckFlowControl(serial, map.keys(), problems);
  return serial;
}

void ReadSerialExtras(MapReader& line, SerialSettings& serial) {
  const auto node = line.Get("parity");
  const auto given = std::find_if(kParities.begin(), kParities.end(), [&](const auto& known) {
    return node && node->kind() == YamlNode::Kind::scalar && node->text() == known.word &&
           known.meaning != kSoftware;
  });
  if (given != kParities.end()) {
    SerialSettings meant = serial;
    meant.parity = *given->meaning;
    line.problems().Error(
        node->mark(),
        "parity: " + Quoted(node->text()) +
            " belongs to the serial settings; write for example "
            "serial: " +
            meant.ToString() +
            " (the key parity only selects who makes the parity bit: hardware or software)");
  } else if (const auto software = line.OneOf("parity", kWhoMakesParity)) {
    serial.software_parity = *software;
    CheckSoftwareParity(serial, line.MarkOf("parity"), line.problems());
  }
  if (const auto rs485 = line.Get("rs485")) {
    serial.rs485 = ReadRs485(*rs485, serial.rs485, line.problems());
  }
}

Pace ReadPace(MapReader& map, Level level) {
  Pace pace;
  map.Read<&Pace::poll, &Pace::slow, &Pace::daily, &Pace::retries, &Pace::recheck>(pace);
  if (const auto timing = map.Get("timing")) pace.timing = ReadTiming(*timing, map.problems());
  pace.timing.from.fill(level);
  return pace;
}

namespace {

PortServer ReadPortServer(const YamlNode& node, const std::string& key, LoadContext& context) {
  PortServer server;
  server.mark = node.mark();
  MapReader map(node, key, context.problems);
  if (node.kind() != YamlNode::Kind::map) return server;
  if (const auto at = map.Need("at", "\"127.0.0.1:4001\"")) {
    Assign(server.at, ReadOwnAddress(*at, "at", "127.0.0.1:4001", context.problems));
  }
  map.Read<&PortServer::mode>(server);
  if (const auto allow = map.Get("allow")) {
    server.allow = ReadNetworks(*allow, "allow", context.problems);
  }
  map.Read<&PortServer::idle>(server);
  if (key == "lend") {
    map.Read<&PortServer::time>(server);
  } else {
    map.Read<&PortServer::busy>(server);
  }
  server.tls = ReadServerTls(map, "ports");
  map.Finish();
  if (server.at.port == 0) return server;
  CheckPortServer(server, key, context.problems);
  context.uniques.Address(key, server.at, server.mark);
  return server;
}

/// Reads `serial_server: { at: "127.0.0.1:4001", mode: rfc2217, busy: wait }`, or `lend: { at:
/// "0.0.0.0:4001", for: 30min, allow: [10.0.0.7] }`.
void ReadPortServers(MapReader& map, Line& line, LoadContext& context) {
  if (const auto node = map.Get("serial_server")) {
    line.serial_server = ReadPortServer(*node, "serial_server", context);
  }
  if (const auto node = map.Get("lend")) line.lend = ReadPortServer(*node, "lend", context);
  CheckPortServers(line, map.keys(), context.problems);
}

constexpr std::size_t kMostLines = 1000;
constexpr std::size_t kMostDevices = 1000;

Result<std::string> ParsePort(const std::string& text) {
  if (text.starts_with("/")) return text;
  if (!IsNetworkPort(text)) {
    return Error{Quoted(text) +
                 " is neither a path like /dev/ttyUSB0 nor tcp://host:port or tls://host:port"};
  }
  if (const Status zero = RefuseLeadingZeros(text, ":"); !zero) return Error{zero.error()};
  if (ParseHostPort(text.substr(kTcpScheme.size()))) return text;
  return Error{Quoted(text) + " is not " + text.substr(0, kTcpScheme.size()) +
               "host:port; write for example tcp://10.0.0.5:4001"};
}

void ReadPort(MapReader& map, bool shared, Line& line, LoadContext& context) {
  const auto node = map.Need("port", "/dev/ttyUSB0");
  if (!node) return;
  if (!Assign(line.port, ReadParsed(*node, "port", context.problems, ParsePort))) return;
  context.uniques.Port(line.port, line.name, shared, node->mark());
}

// Adds to the line the defaults of all options of its devices' protocols that the line does not
// set: a Bus (protocols/protocol.h) reads its options from the line, also for devices with their
// own protocol.
void CompleteOptions(Line& line, const Options& given, const Catalog& catalog) {
  for (const Device& device : line.devices) {
    const protocols::Protocol* protocol = catalog.FindProtocol(device.protocol);
    if (protocol) Override(line.options, DefaultOptions(*protocol));
  }
  const protocols::Protocol* own = catalog.FindProtocol(line.protocol);
  if (own) Override(line.options, DefaultOptions(*own));
  Override(line.options, given);
}

// Reports a device that sends unasked and is not alone on its line, because its bytes could be
// mistaken for a reply.
void CheckSpeakers(const Line& line, const Catalog& catalog, Problems& problems) {
  if (line.devices.size() < 2) return;
  for (const Device& device : line.devices) {
    const protocols::Protocol* protocol = catalog.FindProtocol(device.protocol);
    if (protocol == nullptr || !SpeaksUnasked(*protocol, device.options)) continue;
    problems.Error(device.mark,
                   "device '" + device.name +
                       "' sends without requests and needs a line of its own, but line '" +
                       line.name + "' has " + std::to_string(line.devices.size()) +
                       " devices; move the other devices to another line");
    return;
  }
}

Line ReadLine(const YamlNode& node, LoadContext& context) {
  Line line;
  line.mark = node.mark();
  MapReader map(node, "line", context.problems);
  if (node.kind() != YamlNode::Kind::map) return line;
  if (const auto name = ReadName(map, "bay-1")) {
    line.name = *name;
    context.uniques.Line(line.name, map.MarkOf("name"));
  }
  const protocols::Protocol* protocol = nullptr;
  const bool unpolled =
      map.Has("lend") && !map.Has("devices") && !map.Has("protocol") && !map.Has("serial_server");
  if (unpolled) {
    context.problems.Error(
        map.MarkOf("lend"),
        "lend: only a port that the gateway polls can be lent, but this line has no protocol and "
        "no devices; add them, or use serial_server instead");
  }
  const bool served = map.Has("serial_server") || unpolled;
  if (const auto name = served ? map.Get("protocol") : map.Need("protocol", "spabus")) {
    const auto port = map.Get("port");
    const bool named = port && port->kind() == YamlNode::Kind::scalar;
    protocol = ReadProtocol(*name, named ? port->text() : std::string(), context);
    if (protocol) line.protocol = std::string(protocol->name);
    if (!protocol) map.AllowAll();
  }
  if (protocol) line.serial = protocol->serial;
  line.tcp = protocol != nullptr && protocol->tcp;
  ReadPort(map, line.tcp, line, context);
  line.tls = ReadClientTls(map, IsTlsAddress(line.port), "ports");
  if (const auto serial = map.Get("serial")) {
    line.serial = ReadSerial(*serial, line.serial, context.problems);
  }
  ReadSerialExtras(map, line.serial);
  const Mark serial_mark = map.MarkOf("serial");
  if (protocol) CheckDataBits(line.serial, *protocol, serial_mark, context.problems);
  CheckPortSettings(line.port, line.serial, map.Has("rs485") ? map.MarkOf("rs485") : serial_mark,
                    context.problems);
  const Pace pace = Merge(ReadPace(map, Level::line), context.pace);
  line.timing = pace.timing;
  Assign(line.retries, pace.retries);
  map.Read<&Line::echo, &Line::ask>(line);
  line.alarms = ReadAlarmSetting(map, context.alarms);
  if (protocol) CheckTcp(*protocol, line.port, map.keys(), context.problems);
  Options given;
  if (protocol) given = ReadOptions(map, *protocol, protocols::OptionSpec::Scope::line);
  const auto devices = map.Get("devices");
  ReadPortServers(map, line, context);
  map.Finish();
  if (devices) {
    LineAddresses addresses;
    for (const YamlNode& device : ReadList(*devices, "devices", kMostDevices, context.problems)) {
      line.devices.push_back(ReadDevice(device, {line, pace, given, protocol, addresses}, context));
    }
  }
  CompleteOptions(line, given, context.catalog);
  CheckSpeakers(line, context.catalog, context.problems);
  return line;
}

}  // namespace

std::vector<Line> ReadLines(const YamlNode& list, LoadContext& context) {
  std::vector<Line> lines;
  for (const YamlNode& node : ReadList(list, "lines", kMostLines, context.problems)) {
    lines.push_back(ReadLine(node, context));
  }
  return lines;
}

}  // namespace baudgate::config
