// SPDX-License-Identifier: Apache-2.0
#include "config/model/route.h"

#include "gateway/base/text.h"

namespace baudgate::config {

std::uint8_t Route::SlaveOf(std::uint8_t unit) const {
  return remap ? static_cast<std::uint8_t>(*remap + (unit - first)) : unit;
}

std::string Route::Units() const {
  return first == last ? std::to_string(first) : std::to_string(first) + "-" + std::to_string(last);
}

std::string Route::Target() const {
  return line.empty() ? "server " + HostAndPort(host, port) : "line " + line;
}

}  // namespace baudgate::config
