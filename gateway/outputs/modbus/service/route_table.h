// `RouteTable` maps each unit to what answers for it: a device, the gateway itself, or a
// transparent route. Pure; made again from each configuration, and used by router.cpp for every
// request. `RouteList` numbers the routes.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "config/model/config.h"
#include "config/model/outputs.h"

namespace baudgate::modbus {

// `RouteList` gives each route a number that never changes, so that the end of a request is counted
// at its route even if a reload comes in between. Pure; on the server's thread.
//
//   file             numbers()      file after a reload   numbers()
//   20 to drive      0              33 to pumps           2 (new)
//   21 to drive      1              21 to drive           1 (the same)
//
// Route 0 is still in the list, but no unit leads to it.

/// For each entry of a list in the new file, its index in the old file; empty: it is new.
using Origins = std::vector<std::optional<std::size_t>>;

class RouteList {
 public:
  explicit RouteList(const std::vector<config::Route>& routes) {
    Renew(routes, Origins(routes.size()));
  }
  /// Applies the routes of a reload. Line indexes may differ in routes that are otherwise
  /// unchanged.
  void Renew(const std::vector<config::Route>& routes, const Origins& origins);

  /// Returns a route by its number; also routes that were removed.
  const config::Route& at(std::size_t number) const { return routes_[number]; }
  std::size_t size() const { return routes_.size(); }
  /// The numbers of the routes in the running file, in its order.
  std::span<const std::size_t> numbers() const { return numbers_; }

 private:
  std::vector<config::Route> routes_;
  std::vector<std::size_t> numbers_;
};

struct Way {
  enum class Kind : std::uint8_t {
    none,     ///< nothing answers: exception 0x0A
    device,   ///< answered from the point store
    gateway,  ///< answered with the gateway's status block
    route,
  };
  Kind kind = Kind::none;
  std::uint32_t route = 0;  ///< the number of the route
};

/// Units of devices come first, then the first route whose range contains the unit, then 0 and 255
/// as the gateway itself.
class RouteTable {
 public:
  RouteTable(const config::Config& config, const RouteList& routes);

  const Way& of(std::uint8_t unit) const { return ways_[unit]; }

 private:
  std::array<Way, 256> ways_{};
};

}  // namespace baudgate::modbus
