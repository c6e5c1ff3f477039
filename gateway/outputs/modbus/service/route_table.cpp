// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/service/route_table.h"

#include <utility>

namespace baudgate::modbus {

void RouteList::Renew(const std::vector<config::Route>& routes, const Origins& origins) {
  const std::vector<std::size_t> before = std::exchange(numbers_, {});
  for (std::size_t i = 0; i < routes.size(); ++i) {
    const std::size_t number = origins[i] ? before[*origins[i]] : routes_.size();
    if (number == routes_.size()) routes_.emplace_back();
    routes_[number] = routes[i];
    numbers_.push_back(number);
  }
}

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
