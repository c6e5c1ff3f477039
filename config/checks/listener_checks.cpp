// SPDX-License-Identifier: Apache-2.0
#include "config/checks/listener_checks.h"

#include <algorithm>

#include "config/model/network.h"
#include "gateway/base/spelling.h"

namespace baudgate::config {

void CheckListener(const Listener& listener, const Catalog& catalog, Problems& problems) {
  if (listener.speaks_serial() && !catalog.FramesOf(listener.framing)) {
    const auto installed = catalog.ProtocolNames();
    problems.Error(listener.mark, "listen: " + std::string(Name(listener.framing)) +
                                      " needs a protocol that makes " +
                                      std::string(Title(listener.framing)) +
                                      " frames, and none is installed; installed: " +
                                      (installed.empty() ? "none" : Join(installed)));
  }
  if (listener.is_serial() || listener.allow.empty()) return;
  const Network reach = ReachOf(listener.host);
  const bool can_come = std::any_of(
      listener.allow.begin(), listener.allow.end(),
      [&](const Network& network) { return IsLoopback(network) || Covers(network, reach); });
  if (IsLoopback(reach) && !can_come) {
    problems.Warning(listener.mark, "listen: " + listener.Place() +
                                        " takes connections from this machine only, and 'allow' "
                                        "has only others: nobody can come in; write for example "
                                        "at: \"0.0.0.0:" +
                                        std::to_string(listener.port) + "\"");
  }
  if (!IsEverywhere(listener.host)) return;
  if (std::all_of(listener.allow.begin(), listener.allow.end(), IsLoopback)) {
    problems.Warning(listener.mark, "listen: " + listener.host +
                                        " takes connections from everywhere, but 'allow' has only "
                                        "loopback; write 127.0.0.1 or allow the masters' network");
  }
}

void CheckClient(const ClientPriority& client, const Listener& listener, const Mark& mark,
                 Problems& problems) {
  const Network& from = client.from;
  for (const ClientPriority& earlier : listener.clients) {
    if (!Covers(earlier.from, from)) continue;
    problems.Warning(mark, "from: " + from.text + " has no effect: " + earlier.from.text +
                               " stands first and covers it");
    return;
  }
  const bool can_come = std::any_of(
      listener.allow.begin(), listener.allow.end(),
      [&](const Network& network) { return Covers(network, from) || Covers(from, network); });
  if (!listener.allow.empty() && !can_come) {
    problems.Warning(
        mark, "from: " + from.text + " has no effect: 'allow' excludes all of these addresses");
  }
}

}  // namespace baudgate::config
