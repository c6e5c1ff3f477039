// `baudgate simulate`: runs a twin on a pty, or the twins of a whole configuration.
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
  /// Empty: the protocol that has the profile.
  std::string protocol{};
  std::string address;
  std::string pty;     ///< path of the symbolic link to the pty
  std::string serial;  ///< "9600 7E1": the twin's bit rate; empty: no delays
  Duration think_time = 5ms;
  std::vector<std::string> set;  ///< device options, "key=value"
  std::vector<Fault> faults;
  std::optional<EventSchedule> events{};
};

struct SimulateConfigOptions {
  std::string file;
  std::string write;  ///< copy of the configuration with the twins' ports; empty: none
  /// Folder of the twins' ports, with `write`; empty: a folder beside the written file.
  std::string ports;
  Duration think_time = 5ms;
  std::vector<Fault> faults;
  std::optional<EventSchedule> events{};
};

/// Without `write`, the ports have the configured paths. Exit codes: 0 stopped; 3 bad
/// configuration; 4 a port or the file cannot be written.
int RunSimulateConfig(const SimulateConfigOptions& options, const config::Catalog& catalog,
                      std::ostream& out, std::ostream& err);

/// Runs until SIGTERM or SIGINT, then prints the counts of faults and events. Exit codes: 0
/// stopped; 3 unknown profile, or invalid address or option; 4 no pty can be made.
int RunSimulate(const SimulateOptions& options, const config::Catalog& catalog, std::ostream& out,
                std::ostream& err);

}  // namespace baudgate::tools
