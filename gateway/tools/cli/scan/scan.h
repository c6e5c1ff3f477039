// `baudgate scan`: which devices are on this bus, at which settings and addresses, and with which
// profiles. Reads only; what may be sent is listed by each protocol (protocols/scanning.h).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <ostream>
#include <string>

#include "config/catalog/catalog.h"
#include "gateway/tools/scan/plan.h"

namespace baudgate {

struct ScanOptions {
  std::string target;    ///< a port, or a line of the running gateway
  std::string protocol;  ///< empty: all that can be looked for
  std::optional<scan::Addresses> addresses;
  bool quick = false;
  bool json = false;
  bool over_traffic = false;
  bool rs485 = false;  ///< the port's driver switches the direction
  std::string config;  ///< a file to write; empty: none
  bool force = false;  ///< it may be there
  std::string socket;  ///< of the gateway; empty: the default places
  std::size_t width = 0;
};

/// Exit code 0, devices or none; 2 for a wrong word; 4 where the port cannot be opened, is lost,
/// or others speak on it.
int RunScan(const ScanOptions& options, const config::Catalog& catalog, std::ostream& out,
            std::ostream& err);

}  // namespace baudgate
