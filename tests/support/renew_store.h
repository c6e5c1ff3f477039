// Changes the configuration of a point store in a test, as a reload without a restart does.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include "config/model/config.h"
#include "gateway/bus/points/point_store.h"

namespace baudgate {

inline void Renew(bus::PointStore& store, const config::Config& config) {
  for (std::uint32_t line = 0; line < config.lines.size(); ++line) {
    store.Reconfigure(line, std::make_shared<const config::Line>(config.lines[line]));
  }
}

}  // namespace baudgate
