// `baudgate ports`: the serial ports of this machine, what to call them in a configuration, who has
// them, and what keeps the gateway from having them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <ostream>
#include <string>
#include <vector>

#include "gateway/tools/cli/ports/port_rights.h"

namespace baudgate {

struct PortsOptions {
  bool json = false;
  std::string socket;  ///< of the gateway; empty: the default places
};

/// What of it is the machine's.
struct PortsPlace {
  std::filesystem::path root = "/";
  std::vector<Person> people;
  /// As `baudgate status --json`; null: no gateway runs.
  std::function<nlohmann::ordered_json()> status;
};

/// Exit code 0, ports or none.
int ShowPorts(bool json, const PortsPlace& place, std::ostream& out);
/// The same of this machine.
int RunPorts(const PortsOptions& options, std::ostream& out);

}  // namespace baudgate
