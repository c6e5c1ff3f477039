// `baudgate demo`: runs twins (simulated devices) of all shipped device types and a gateway, and
// shows live readings.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <ostream>

#include "config/catalog/catalog.h"
#include "gateway/base/time.h"

namespace baudgate::tools {

struct DemoOptions {
  std::optional<Duration> seconds;  ///< ends after this time; empty: ends at SIGINT or SIGTERM
  /// The port of Modbus TCP. If it is in use, the next free port above it is taken.
  std::uint16_t port = 1502;
  int domain = 0;
};

/// Exit codes: 0 every simulated device was read; 3 a profile has errors; 4 an open failed, or a
/// simulated device is silent.
int RunDemo(const DemoOptions& options, const config::Catalog& catalog, std::ostream& out,
            std::ostream& err);

}  // namespace baudgate::tools
