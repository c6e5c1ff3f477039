// `baudgate simulate`: a device twin from a profile, on a pty linked at a path.
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
  std::string protocol{};  ///< empty: the one whose profile it is; modbus_ascii uses modbus_rtu's
  std::string address;
  std::string pty;     ///< where the link is put
  std::string serial;  ///< "9600 7E1": the twin keeps this bit rate; empty: no pacing
  Duration think_time = 5ms;
  std::vector<std::string> set;  ///< device options, "key=value"
  std::vector<Fault> faults;
  std::optional<EventSchedule> events{};
};

/// The twins of all lines of a configuration.
struct SimulateConfigOptions {
  std::string file;
  std::string write;  ///< where the same configuration is written with ports of the twins
  std::string ports;  ///< folder of those ports; empty: beside the file that is written
  Duration think_time = 5ms;
  std::vector<Fault> faults;
  std::optional<EventSchedule> events{};
};

/// Until SIGTERM or SIGINT. Without `write` the ports are made where the configuration has them.
/// Exit codes: 0 stopped, 3 bad configuration, 4 a port cannot be made, or a file not written.
int RunSimulateConfig(const SimulateConfigOptions& options, const config::Catalog& catalog,
                      std::ostream& out, std::ostream& err);

/// Until SIGTERM or SIGINT; then one line a fault says how often it struck, and one how many events
/// there were. Exit codes: 0 stopped,
/// 3 no such profile, bad address or option, 4 no pty.
int RunSimulate(const SimulateOptions& options, const config::Catalog& catalog, std::ostream& out,
                std::ostream& err);

}  // namespace baudgate::tools
