// What answers for a unit: a device, the gateway itself, or a transparent route. Pure; made again
// from each configuration, used by router.cpp for every request.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "config/model/config.h"
#include "gateway/outputs/modbus/service/route_list.h"

namespace baudgate::modbus {

struct Way {
  enum class Kind : std::uint8_t {
    none,     ///< nobody: 0x0A
    device,   ///< out of the point store
    gateway,  ///< the gateway's own block
    route,
  };
  Kind kind = Kind::none;
  std::uint32_t route = 0;  ///< its number (route_list.h)
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
