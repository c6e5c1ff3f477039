// SPDX-License-Identifier: Apache-2.0
#include "config/lines.h"

#include <algorithm>

#include "config/alarms.h"
#include "config/catalog/option_values.h"
#include "config/checks/serial_checks.h"
#include "config/devices.h"
#include "config/model/network.h"
#include "config/names.h"
#include "config/options.h"
#include "config/port_server.h"
#include "config/serial.h"
#include "gateway/base/leading_zero.h"
#include "gateway/base/spelling.h"

namespace baudgate::config {
namespace {

constexpr std::size_t kMostLines = 1000;
constexpr std::size_t kMostDevices = 1000;

constexpr std::array<Word<Echo>, 3> kEchoes = {
    {{"off", Echo::off}, {"strip", Echo::strip}, {"verify", Echo::verify}}};
constexpr std::array<Word<Ask>, 2> kAsks = {{{"deny", Ask::deny}, {"write", Ask::write}}};

void ReadPort(MapReader& map, bool shared, Line& line, LoadContext& context) {
  const auto node = map.Need("port", "/dev/ttyUSB0");
  if (!node) return;
  const auto port = ReadText(*node, "port", context.problems);
  if (!port) return;
  constexpr std::string_view kTcp = "tcp://";
  if (port->starts_with(kTcp)) {
    const auto at = ParseHostPort(port->substr(kTcp.size()));
    if (const Status zero = RefuseLeadingZeros(*port, ":"); !zero) {
      return context.problems.Error(node->mark(), "port: " + zero.error());
    }
    if (!at) {
      context.problems.Error(node->mark(), "port: " + Quoted(*port) +
                                               " is not tcp://host:port; write for example "
                                               "tcp://10.0.0.5:4001");
      return;
    }
  } else if (!port->starts_with("/")) {
    context.problems.Error(node->mark(), "port: " + Quoted(*port) +
                                             " is neither a path like /dev/ttyUSB0 nor "
                                             "tcp://host:port");
    return;
  }
  line.port = *port;
  context.uniques.Port(line.port, line.name, shared, node->mark());
}

// Buses of the devices' own protocols read their options from the line as well.
void CompleteOptions(Line& line, const Options& given, const Catalog& catalog) {
  for (const Device& device : line.devices) {
    const Protocol* protocol = catalog.FindProtocol(device.protocol);
    if (protocol) Override(line.options, DefaultOptions(*protocol));
  }
  const Protocol* own = catalog.FindProtocol(line.protocol);
  if (own) Override(line.options, DefaultOptions(*own));
  Override(line.options, given);
}

// Whatever else is spoken there might be taken for what it says, and the other way round.
void CheckSpeakers(const Line& line, const Catalog& catalog, Problems& problems) {
  if (line.devices.size() < 2) return;
  for (const Device& device : line.devices) {
    const Protocol* protocol = catalog.FindProtocol(device.protocol);
    if (protocol == nullptr || !SpeaksUnasked(*protocol, device.options)) continue;
    problems.Error(device.mark, "device '" + device.name +
                                    "' speaks unasked and needs a line of its own; line '" +
                                    line.name + "' has " + std::to_string(line.devices.size()) +
                                    " devices");
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
  const Protocol* protocol = nullptr;
  const bool unpolled =
      map.Has("lend") && !map.Has("devices") && !map.Has("protocol") && !map.Has("serial_server");
  if (unpolled) {
    context.problems.Error(
        map.MarkOf("lend"),
        "lend: nobody polls this port, so it is not lent; write serial_server in "
        "its place, or add protocol and devices");
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
  Assign(line.echo, map.OneOf("echo", kEchoes));
  Assign(line.ask, map.OneOf("ask", kAsks));
  line.alarms = ReadAlarmSetting(map, context.alarms);
  if (protocol) CheckTcp(*protocol, line.port, map.keys(), context.problems);
  Options given;
  if (protocol) given = ReadOptions(map, *protocol, OptionSpec::Scope::line);
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
