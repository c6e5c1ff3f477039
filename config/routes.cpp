// SPDX-License-Identifier: Apache-2.0
#include "config/routes.h"

#include <algorithm>
#include <string>
#include <string_view>
#include <tuple>

#include "config/alarms.h"
#include "config/checks/route_checks.h"
#include "config/model/network.h"
#include "config/model/units.h"
#include "gateway/base/spelling.h"

namespace baudgate::config {
namespace {

void ReadTargetLine(const YamlNode& node, const std::vector<Line>& lines, Route& route,
                    LoadContext& context) {
  const auto name = ReadText(node, "line", context.problems);
  if (!name) return;
  const auto line =
      std::find_if(lines.begin(), lines.end(), [&](const Line& one) { return one.name == *name; });
  if (name->empty() || line == lines.end()) {
    std::vector<std::string_view> names;
    for (const Line& one : lines) {
      if (!one.name.empty()) names.push_back(one.name);
    }
    context.problems.Error(node.mark(), "line: there is no line " + Quoted(*name) + ";" +
                                            DidYouMean(*name, names) +
                                            " lines: " + (names.empty() ? "none" : Join(names)));
    return;
  }
  route.line = *name;
  route.line_index = static_cast<std::size_t>(line - lines.begin());
  const Protocol* protocol = context.catalog.FindProtocol(line->protocol);
  if (!protocol || protocol->carrier) return;
  if (protocol->tcp) {
    context.problems.Error(
        node.mark(), "line: '" + *name + "' is a Modbus TCP server, which needs " +
                         "no line to be routed to; write server: \"" +
                         (line->port.starts_with("tcp://") ? line->port.substr(6) : "host:502") +
                         "\" in place of line");
    return;
  }
  std::vector<std::string_view> carriers;
  for (const auto& [known, one] : context.catalog.protocols) {
    if (one->carrier) carriers.push_back(known);
  }
  context.problems.Error(node.mark(), "line: '" + *name + "' speaks " + line->protocol +
                                          ", which carries no Modbus requests; installed "
                                          "protocols that do: " +
                                          (carriers.empty() ? "none" : Join(carriers)));
}

void ReadTargetServer(const YamlNode& node, const std::vector<Listener>& listeners, Route& route,
                      Problems& problems) {
  const auto text = ReadText(node, "server", problems);
  if (!text) return;
  const auto server = ParseServer(*text, route.port);
  if (!server) {
    problems.Error(node.mark(), "server: " + server.error());
    return;
  }
  route.host = server->host == "localhost" ? "127.0.0.1" : server->host;
  route.port = server->port;
  CheckServer(route, listeners, node.mark(), problems);
}

}  // namespace

Route ReadRoute(const YamlNode& node, const std::vector<Listener>& listeners,
                const std::vector<Line>& lines, LoadContext& context) {
  Route route;
  route.mark = node.mark();
  MapReader map(node, "a route", context.problems);
  if (node.kind() != YamlNode::Kind::map) return route;
  bool units_known = false;
  if (const auto units = map.Need("units", "20")) {
    if (const auto text = ReadText(*units, "units", context.problems)) {
      const auto range = ParseUnits(*text);
      units_known = range.ok();
      if (range) {
        std::tie(route.first, route.last) = *range;
      } else {
        context.problems.Error(units->mark(), "units: " + range.error());
      }
    }
  }
  if (const auto line = map.Get("line")) ReadTargetLine(*line, lines, route, context);
  if (const auto server = map.Get("server")) {
    ReadTargetServer(*server, listeners, route, context.problems);
  }
  Assign(route.remap, map.Integer<std::uint8_t>("remap", 0, 255));
  Assign(route.deadline, map.Time("deadline", 50ms, 1min));
  route.alarms =
      ReadAlarmSetting(map, route.line.empty() ? context.alarms : lines[route.line_index].alarms);
  map.Finish();
  const Keys keys = map.keys();
  CheckTarget(keys, context.problems);
  if (units_known) CheckRoute(route, keys, context.problems);
  return route;
}

}  // namespace baudgate::config
