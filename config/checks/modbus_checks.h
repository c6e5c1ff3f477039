// RangeText formats units and registers for messages: "7", "33…40". CheckListener checks listeners,
// and CheckRoutes checks routes.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "config/catalog/catalog.h"
#include "config/model/config.h"
#include "config/model/outputs.h"
#include "config/model/problem.h"

namespace baudgate::config {

inline std::string RangeText(int first, int last) {
  if (first == last) return std::to_string(first);
  return std::to_string(first) + "…" + std::to_string(last);
}

// Checks that the framing of the listener is installed, and that its allowed clients can reach it.

void CheckListener(const Listener& listener, const Catalog& catalog, Problems& problems);
/// Warns if `client`, the next entry of `listener.clients`, can never apply. `mark` is the position
/// of its key `from` in the file.
void CheckClient(const ClientPriority& client, const Listener& listener, const Mark& mark,
                 Problems& problems);

/// Checks that the route has exactly one of `line` and `server`. `route` are the route's keys.
void CheckTarget(const Keys& route, Problems& problems);
void CheckRoute(const Route& route, const Keys& keys, Problems& problems);
/// Reports a route to one of the gateway's own listeners, where requests would circulate. `mark` is
/// the position of the key `server` in the file.
void CheckServer(const Route& route, const std::vector<Listener>& listeners, const Mark& mark,
                 Problems& problems);

/// Warns of units that never reach their route, and of deadlines that are too short. `config` has
/// no errors.
/// Warns of each listener that lets every machine write to a point or a slave. `allow: everybody`
/// says that this is meant.
void CheckOpenListeners(const Config& config, Problems& problems);

void CheckRoutes(const Config& config, const Catalog& catalog, Problems& problems);
/// Warns of lines without devices and routes, and of `broadcast: pass` without a route that takes
/// broadcasts. A route to a line with serial_server is an error.
void CheckUse(const Config& config, Problems& problems);

}  // namespace baudgate::config
