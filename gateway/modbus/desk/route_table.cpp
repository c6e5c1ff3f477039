// SPDX-License-Identifier: Apache-2.0
#include "gateway/modbus/desk/route_table.h"

namespace baudgate::modbus {

RouteTable::RouteTable(const config::Config& config) {
  ways_.front().kind = ways_.back().kind = Way::Kind::gateway;
  const auto& routes = config.modbus.routes;
  for (std::size_t i = routes.size(); i-- > 0;) {
    for (unsigned unit = routes[i].first; unit <= routes[i].last; ++unit) {
      ways_[unit] = {Way::Kind::route, static_cast<std::uint32_t>(i)};
    }
  }
  for (const config::Line& line : config.lines) {
    for (const config::Device& device : line.devices) {
      if (device.unit) ways_[*device.unit] = {Way::Kind::device, 0};
    }
  }
}

}  // namespace baudgate::modbus
