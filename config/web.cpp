// SPDX-License-Identifier: Apache-2.0
#include "config/web.h"

#include <algorithm>
#include <array>

#include "config/listeners.h"
#include "config/outputs.h"
#include "gateway/base/spelling.h"

namespace baudgate::config {
namespace {

constexpr std::size_t kMostHosts = 100;
constexpr std::array<Word<bool>, 2> kAcknowledge = {{{"deny", false}, {"allow", true}}};

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
  if (const auto listen = map.Get("listen")) {
    Assign(web.listen, ReadOwnAddress(*listen, "listen", "127.0.0.1:8502", problems));
  }
  if (const auto allow = map.Get("allow")) web.allow = ReadAllowOrAll(*allow, problems);
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
