// SPDX-License-Identifier: Apache-2.0
#include "config/checks/port_server_checks.h"

#include <algorithm>

namespace baudgate::config {

void CheckPortServer(const PortServer& server, const std::string& key, Problems& problems) {
  if (server.on_loopback()) return;
  if (server.allow.empty()) {
    problems.Error(server.mark,
                   key + ": " + server.Place() +
                       " can be reached from other machines; say who may come in, for example "
                       "allow: [10.0.0.7], or listen on 127.0.0.1");
  } else if (!std::ranges::all_of(server.allow, IsLoopback)) {
    problems.Warning(server.mark,
                     key + ": whoever `allow` lets in at " + server.Place() +
                         " speaks to the devices at this port as it likes: no `write: deny`, limit "
                         "or interlock holds there (docs/security.md)");
  }
}

void CheckPortServers(const Line& line, const Keys& keys, Problems& problems) {
  if (line.lend && line.serial_server) {
    problems.Error(keys.MarkOf("lend"),
                   "lend: the port is served all the time; remove lend or serial_server");
  }
  if (!line.serial_server) return;
  if (keys.Has("devices")) {
    problems.Error(keys.MarkOf("serial_server"),
                   "serial_server: the gateway asks the devices of this line; write lend in its "
                   "place, or remove the devices");
  }
  for (const char* const key :
       {"protocol", "timing", "retries", "poll", "slow", "daily", "recheck", "echo", "ask"}) {
    if (!keys.Has(key)) continue;
    problems.Warning(keys.MarkOf(key), std::string(key) +
                                           ": has no effect, because the gateway asks nobody at a "
                                           "port that it serves; remove the key");
  }
}

}  // namespace baudgate::config
