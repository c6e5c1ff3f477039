// `RouteTable` tells what answers for a unit: a device, the gateway itself, or a transparent route.
// A reload makes a new table, and gateway/outputs/modbus/service/router.cpp uses it for every
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
// at its route even if a reload came in between. It is used only on the server's thread.
//
//   file             numbers()      file after a reload   numbers()
//   20 to drive      0              33 to pumps           2 (new)
//   21 to drive      1              21 to drive           1 (the same)
//
// In this example, route 0 stays in the list, but no unit leads to it.

/// For each entry of a list in the new file: its index in the old file; nothing: the entry is new.
using Origins = std::vector<std::optional<std::size_t>>;

class RouteList {
 public:
  explicit RouteList(const std::vector<config::Route>& routes) {
    Renew(routes, Origins(routes.size()));
  }
  /// Applies the routes of a reload. An unchanged route keeps its number; its line index can
  /// change.
  void Renew(const std::vector<config::Route>& routes, const Origins& origins);

  const config::Route& at(std::size_t number) const { return routes_[number]; }
  std::size_t size() const { return routes_.size(); }
  std::span<const std::size_t> numbers() const { return numbers_; }

 private:
  std::vector<config::Route> routes_;
  std::vector<std::size_t> numbers_;
};

struct Way {
  enum class Kind : std::uint8_t {
    none,     ///< no device or route has the unit: the client gets exception 0x0A
    device,   ///< answered from the point store
    gateway,  ///< answered by the gateway itself (status and events)
    route,
  };
  Kind kind = Kind::none;
  std::uint32_t route = 0;
};

/// Finds what answers for a unit: a device with this unit, else the first route whose range
/// contains the unit, else the gateway itself for 0 and 255.
class RouteTable {
 public:
  RouteTable(const config::Config& config, const RouteList& routes);

  const Way& of(std::uint8_t unit) const { return ways_[unit]; }

 private:
  std::array<Way, 256> ways_{};
};

}  // namespace baudgate::modbus
