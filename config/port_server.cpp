// SPDX-License-Identifier: Apache-2.0
#include "config/port_server.h"

#include <array>

#include "config/checks/port_server_checks.h"
#include "config/listeners.h"

namespace baudgate::config {
namespace {

constexpr std::array<Word<PortServer::Mode>, 2> kModes = {
    {{"raw", PortServer::Mode::raw}, {"rfc2217", PortServer::Mode::rfc2217}}};
constexpr std::array<Word<PortServer::Busy>, 2> kBusy = {
    {{"refuse", PortServer::Busy::refuse}, {"wait", PortServer::Busy::wait}}};

PortServer ReadPortServer(const YamlNode& node, const std::string& key, LoadContext& context) {
  PortServer server;
  server.mark = node.mark();
  MapReader map(node, key, context.problems);
  if (node.kind() != YamlNode::Kind::map) return server;
  if (const auto at = map.Need("at", "\"127.0.0.1:4001\"")) {
    Assign(server.at, ReadOwnAddress(*at, "at", "127.0.0.1:4001", context.problems));
  }
  Assign(server.mode, map.OneOf("mode", kModes));
  if (const auto allow = map.Get("allow")) {
    server.allow = ReadAllowOrAll(*allow, context.problems);
  }
  Assign(server.idle, map.Time("idle", 1s, 24h));
  if (key == "lend") {
    Assign(server.time, map.Time("for", 1s, 24h));
  } else {
    Assign(server.busy, map.OneOf("busy", kBusy));
  }
  map.Finish();
  if (server.at.port == 0) return server;
  CheckPortServer(server, key, context.problems);
  context.uniques.Address(key, server.at, server.mark);
  return server;
}

}  // namespace

void ReadPortServers(MapReader& map, Line& line, LoadContext& context) {
  if (const auto node = map.Get("serial_server")) {
    line.serial_server = ReadPortServer(*node, "serial_server", context);
  }
  if (const auto node = map.Get("lend")) line.lend = ReadPortServer(*node, "lend", context);
  CheckPortServers(line, map.keys(), context.problems);
}

}  // namespace baudgate::config
