// The fixture of route tests: configurations, and independent programs as masters and slaves.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tests/system/station.h"

namespace baudgate::system_test {

inline constexpr int kUnit = 20;

class RouteStation : public Station {
 protected:
  /// Each text of a vector becomes a list entry. The first listener is that of port().
  std::string Yaml(const std::vector<std::string>& routes, const std::string& lines,
                   const std::vector<std::string>& more_listeners = {}) const;
  std::string BareLine(const std::string& name, const std::string& keys = {},
                       const std::string& protocol = "modbus_rtu") const;
  std::string FarEnd(const std::string& line) const { return LinkOf(line + ".far"); }

  /// Starts a slave of pymodbus on a tty and waits until it has opened the tty.
  std::unique_ptr<Child> StartPymodbusSlave(const std::string& framing, const std::string& tty,
                                            const std::string& units,
                                            std::vector<std::string> ranges = {}) const;
  Json Pymodbus(const std::string& framing, const std::string& where, int unit,
                std::vector<std::string> commands) const;
  Finished Mbpoll(std::vector<std::string> words) const;
  /// Runs mbpoll on port(): `words` are placed before the host, `values` behind it.
  Finished MbpollTcp(const std::string& units, std::vector<std::string> words,
                     std::vector<std::string> values = {}) const;

  /// Starts `baudgate run` and waits until its Modbus port answers and these lines are open.
  std::unique_ptr<Child> StartGateway(const std::string& yaml,
                                      const std::vector<std::string>& lines = {"drive"}) const;
  Json Route(const std::string& units) const;
};

/// Returns the line that mbpoll prints for a register: "[N]: <tab>value".
std::string MbpollLine(int address, int value);

}  // namespace baudgate::system_test
