// `baudgate simulate`: runs a twin (simulated device) on a pty, or the simulated devices of a whole
// configuration.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "config/catalog/catalog.h"
#include "gateway/base/time.h"
#include "gateway/tools/simulate/residents.h"
#include "gateway/tools/simulate/twin_faults.h"

namespace baudgate::tools {

struct SimulateOptions {
  std::string profile;
  /// The protocol; empty: the protocol that has the profile. modbus_ascii uses the profiles of
  /// modbus_rtu.
  std::string protocol{};
  std::string address;
  std::string pty;  ///< path of the symbolic link to the pty
  /// Serial settings, "9600 7E1": the simulated device sends at this bit rate; empty: it sends
  /// without delays.
  std::string serial;
  Duration think_time = 5ms;
  std::vector<std::string> set;  ///< device options, "key=value"
  std::vector<Fault> faults;
  std::optional<EventSchedule> events{};
};

struct SimulateConfigOptions {
  std::string file;
  /// Path of a copy of the configuration in which the lines use the simulated devices' ports;
  /// empty: no copy is written.
  std::string write;
  /// The folder of the simulated devices' ports if `write` is set; empty: a folder beside the
  /// written file.
  std::string ports;
  Duration think_time = 5ms;
  std::vector<Fault> faults;
  std::optional<EventSchedule> events{};
};

/// Runs until SIGTERM or SIGINT. Without `write`, the simulated devices' ports have the paths in
/// the configuration. Exit codes: 0 stopped; 3 bad configuration; 4 a port cannot be made, or
/// `write` names another file or cannot be written.
int RunSimulateConfig(const SimulateConfigOptions& options, const config::Catalog& catalog,
                      std::ostream& out, std::ostream& err);

/// Runs until SIGTERM or SIGINT, then prints how often faults and events occurred. Exit codes: 0
/// stopped; 3 unknown profile, or invalid address or option; 4 no pty can be made.
int RunSimulate(const SimulateOptions& options, const config::Catalog& catalog, std::ostream& out,
                std::ostream& err);

}  // namespace baudgate::tools
