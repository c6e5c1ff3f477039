// The fixture of the tests of transparent routes: configurations with routes, the status of the
// running gateway, and other people's programs as masters and slaves.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tests/system/station.h"

namespace baudgate::system_test {

/// The unit of the slave behind a route.
inline constexpr int kUnit = 20;

class RouteStation : public Station {
 protected:
  // ---- configuration
  /// `listeners` and `routes`: one list entry a text. The first listener is that of port().
  std::string Yaml(const std::vector<std::string>& routes, const std::string& lines,
                   const std::vector<std::string>& more_listeners = {}) const;
  /// A line without devices on the pty of that name.
  std::string BareLine(const std::string& name, const std::string& keys = {},
                       const std::string& protocol = "modbus_rtu") const;
  /// Where the far end of that line's null modem is.
  std::string FarEnd(const std::string& line) const { return LinkOf(line + ".far"); }

  // ---- other people's programs
  /// A slave of pymodbus on a tty, once it has opened it.
  std::unique_ptr<Child> StartPymodbusSlave(const std::string& framing, const std::string& tty,
                                            const std::string& units,
                                            std::vector<std::string> ranges = {}) const;
  /// What a master of pymodbus has got; see pymodbus_master.py.
  Json Pymodbus(const std::string& framing, const std::string& where, int unit,
                std::vector<std::string> commands) const;
  Finished Mbpoll(std::vector<std::string> words) const;
  /// On port(): unit or units, `words` before and `values` behind the host.
  Finished MbpollTcp(const std::string& units, std::vector<std::string> words,
                     std::vector<std::string> values = {}) const;

  // ---- the running gateway
  /// `baudgate run`, once these lines are open, too.
  std::unique_ptr<Child> StartGateway(const std::string& yaml,
                                      const std::vector<std::string>& lines = {"drive"}) const;
  /// The status of a route; null when there is none of these units.
  Json Route(const std::string& units) const;
};

/// "[N]: <tab>value" for each register, as mbpoll prints them.
std::string MbpollLine(int address, int value);

}  // namespace baudgate::system_test
