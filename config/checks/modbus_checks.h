// RangeText gives units and registers for messages: "7", "33…40". CheckListener checks listeners,
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

// Whether a listener can be served, and whether anybody whom it lets in can reach it. Listeners
// come from the readers; what is wrong goes to Problems.

void CheckListener(const Listener& listener, const Catalog& catalog, Problems& problems);
/// Whether the next entry of `listener.clients` can ever apply. `mark`: of its `from`.
void CheckClient(const ClientPriority& client, const Listener& listener, const Mark& mark,
                 Problems& problems);

// Whether routes lead somewhere, their units reach them, and their requests can be answered in
// time. Routes come from the readers, the whole configuration from config/loader; what is wrong
// goes to Problems.

/// Exactly one of `line` and `server`. `route`: the keys of the route.
void CheckTarget(const Keys& route, Problems& problems);
/// Whether the addresses that the route's units become exist where it leads.
void CheckRoute(const Route& route, const Keys& keys, Problems& problems);
/// A route to one of our own listeners would never end. `mark`: of the route's `server`.
void CheckServer(const Route& route, const std::vector<Listener>& listeners, const Mark& mark,
                 Problems& problems);

/// Warns in a configuration without errors: units that never reach their route, deadlines too
/// short. Warnings only.
void CheckRoutes(const Config& config, const Catalog& catalog, Problems& problems);
/// Lines that nobody asks anything, broadcasts that reach no line. Warnings only.
void CheckUse(const Config& config, Problems& problems);

}  // namespace baudgate::config
