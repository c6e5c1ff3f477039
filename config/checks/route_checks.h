// Whether routes lead somewhere, their units reach them, and their requests can be answered in
// time. Routes come from the readers, the whole configuration from config/loader; what is wrong
// goes to Problems.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "config/catalog/catalog.h"
#include "config/model/config.h"
#include "config/model/mark.h"
#include "config/model/problem.h"

namespace baudgate::config {

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
