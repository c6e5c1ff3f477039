// SPDX-License-Identifier: Apache-2.0
#include "config/web.h"

#include <algorithm>
#include <array>

#include "config/listeners.h"
#include "config/outputs.h"
#include "gateway/base/spelling.h"
#include "gateway/base/text.h"

namespace baudgate::config {
namespace {

constexpr std::size_t kMostHosts = 100;
constexpr std::array<Word<bool>, 2> kAcknowledge = {{{"deny", false}, {"allow", true}}};

void ReadListen(MapReader& map, Web& web) {
  const auto text = map.Text("listen");
  if (!text) return;
  const auto at = ParseHostPort(*text);
  if (!at) {
    map.problems().Error(map.MarkOf("listen"), "listen: " + Quoted(*text) +
                                                   " is not host:port; write for example "
                                                   "127.0.0.1:8502");
  } else if (!IsIpAddress(at->host) && at->host != "localhost") {
    map.problems().Error(map.MarkOf("listen"), "listen: " + Quoted(at->host) +
                                                   " is not an address of this machine; write an "
                                                   "IP address, 0.0.0.0 for all");
  } else {
    web.listen = *at;
    if (at->host == "localhost") web.listen.host = "127.0.0.1";
  }
}

/// A name as browsers write it behind "http://", with or without a port.
bool IsHost(std::string_view text) {
  const auto fits = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-' || c == '.' || c == ':' ||
           c == '_' || c == '[' || c == ']';
  };
  return !text.empty() && text.size() <= 260 && std::ranges::all_of(text, fits);
}

void ReadHosts(const YamlNode& list, Web& web, Problems& problems) {
  for (const YamlNode& node : ReadList(list, "hosts", kMostHosts, problems)) {
    const auto text = ReadText(node, "hosts", problems);
    if (!text) continue;
    const std::string host = Lower(*text);
    if (!IsHost(host)) {
      problems.Error(node.mark(), "hosts: " + Quoted(*text) +
                                      " is no name of a machine; write for example "
                                      "gate.example.com, without http://");
      continue;
    }
    web.hosts.push_back(host);
  }
}

void ReadTokenFile(const YamlNode& node, Web& web, Problems& problems) {
  MapReader map(node, "token", problems);
  if (node.kind() != YamlNode::Kind::map) return;
  map.Need("file", "/etc/baudgate/web.token");
  web.token_file = ReadAbsolutePath(map, "file", "/etc/baudgate/web.token");
  web.token_mark = map.MarkOf("file");
  map.Finish();
}

}  // namespace

Web ReadWeb(const YamlNode& node, Problems& problems) {
  Web web;
  web.on = true;
  MapReader map(node, "web", problems);
  ReadListen(map, web);
  const auto allow = map.Get("allow");
  const bool everybody = allow && allow->kind() == YamlNode::Kind::list &&
                         ReadList(*allow, "allow", 1000, problems).empty();
  if (allow && !everybody) web.allow = ReadAllow(*allow, problems);
  if (const auto hosts = map.Get("hosts")) ReadHosts(*hosts, web, problems);
  const auto token = map.Get("token");
  if (token) ReadTokenFile(*token, web, problems);
  Assign(web.acknowledge, map.OneOf("acknowledge", kAcknowledge));
  map.Finish();
  if (!token && !web.on_loopback()) {
    problems.Error(map.MarkOf("listen"),
                   "listen: " + web.Place() +
                       " can be reached from other machines, and nobody would have to log in; add "
                       "token: { file: /etc/baudgate/web.token }, or listen on 127.0.0.1");
  }
  return web;
}

}  // namespace baudgate::config
