// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/service/route_table.h"

namespace baudgate::modbus {

RouteTable::RouteTable(const config::Config& config, const RouteList& routes) {
  ways_.front().kind = ways_.back().kind = Way::Kind::gateway;
  const auto numbers = routes.numbers();
  for (std::size_t i = numbers.size(); i-- > 0;) {
    const std::size_t number = numbers[i];
    const config::Route& route = routes.at(number);
    for (unsigned unit = route.first; unit <= route.last; ++unit) {
      ways_[unit] = {Way::Kind::route, static_cast<std::uint32_t>(number)};
    }
  }
  for (const config::Line& line : config.lines) {
    for (const config::Device& device : line.devices) {
      if (device.unit) ways_[*device.unit] = {Way::Kind::device, 0};
    }
  }
}

}  // namespace baudgate::modbus
