// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/service/route_list.h"

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

}  // namespace baudgate::modbus
