// `baudgate bridge`: a Modbus TCP gateway for one port, in one line.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "config/catalog/catalog.h"

namespace baudgate {

struct BridgeOptions {
  std::string port;                 ///< /dev/…, or tcp://host:port
  std::vector<std::string> serial;  ///< "19200", "8E1"; empty: the protocol's
  std::string protocol = "modbus_rtu";
  std::string listen = "127.0.0.1:1502";
  std::vector<std::string> allow;  ///< networks; needed beyond loopback
  bool read_only = false;
};

/// Until SIGTERM or SIGINT. Exit codes: 0 stopped, 2 it would listen beyond loopback for everybody,
/// 3 words that no configuration could have, 4 it cannot listen.
int RunBridge(const BridgeOptions& options, const config::Catalog& catalog, std::ostream& err);

}  // namespace baudgate
