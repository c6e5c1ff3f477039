// For tests that change the configuration of a point store, as a reload does in place.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include "config/model/config.h"
#include "gateway/bus/points/point_store.h"

namespace baudgate {

/// The store takes over what `config` says now of the same lines, devices and points.
inline void Renew(bus::PointStore& store, const config::Config& config) {
  for (std::uint32_t line = 0; line < config.lines.size(); ++line) {
    store.Reconfigure(line, std::make_shared<const config::Line>(config.lines[line]));
  }
}

}  // namespace baudgate
