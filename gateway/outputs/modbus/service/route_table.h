// What answers for a unit: a device, the gateway itself, or a transparent route. Pure; made again
// from each configuration, used by router.cpp for every request. RouteList keeps the numbers of
// routes.
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

// The routes of the gateway by numbers that are for good, so that a request under way ends at its
// own route whatever a reload does meanwhile. Pure; on the server's thread.
//
//   file             numbers()      file after a reload   numbers()
//   20 to drive      0              33 to pumps           2 (new)
//   21 to drive      1              21 to drive           1 (the same)
//
// Number 0 is still known; only nothing leads there any more.

/// Where each entry of a list in a new file stood in the file before; empty: it
/// is new.
using Origins = std::vector<std::optional<std::size_t>>;

class RouteList {
 public:
  explicit RouteList(const std::vector<config::Route>& routes) {
    Renew(routes, Origins(routes.size()));
  }
  /// A reload. Of routes that are the same the lines may have other numbers.
  void Renew(const std::vector<config::Route>& routes, const Origins& origins);

  /// By number; also of a route that has gone.
  const config::Route& at(std::size_t number) const { return routes_[number]; }
  /// How many numbers have been given out.
  std::size_t size() const { return routes_.size(); }
  /// The routes of the running file, in its order.
  std::span<const std::size_t> numbers() const { return numbers_; }

 private:
  std::vector<config::Route> routes_;
  std::vector<std::size_t> numbers_;
};

struct Way {
  enum class Kind : std::uint8_t {
    none,     ///< nobody: 0x0A
    device,   ///< out of the point store
    gateway,  ///< the gateway's own block
    route,
  };
  Kind kind = Kind::none;
  std::uint32_t route = 0;  ///< its number
};

/// Units of devices come first, then the first route that names the unit, then 0 and 255 as the
/// gateway itself.
class RouteTable {
 public:
  RouteTable(const config::Config& config, const RouteList& routes);

  const Way& of(std::uint8_t unit) const { return ways_[unit]; }

 private:
  std::array<Way, 256> ways_{};
};

}  // namespace baudgate::modbus
