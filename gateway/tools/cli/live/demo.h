// `baudgate demo`: twins of all shipped device types on ptys, the gateway that polls them, and a
// live table of what it reads: everything at work without any hardware.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <ostream>

#include "config/catalog/catalog.h"
#include "gateway/base/time.h"

namespace baudgate::tools {

struct DemoOptions {
  std::optional<Duration> seconds;  ///< empty: until SIGINT or SIGTERM
  std::uint16_t port = 1502;        ///< of Modbus TCP; the next free one above it is taken
  int domain = 0;
};

/// Exit codes: 0 every twin was read, 4 something could not be opened or a twin did not answer.
int RunDemo(const DemoOptions& options, const config::Catalog& catalog, std::ostream& out,
            std::ostream& err);

}  // namespace baudgate::tools
