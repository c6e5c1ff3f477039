// A line and its devices.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "config/model/alarm_setting.h"
#include "config/model/device.h"
#include "config/model/fields.h"
#include "config/model/port_server.h"

namespace baudgate::config {

enum class Echo : std::uint8_t { off, strip, verify };
/// Telegrams by hand that may write.
enum class Ask : std::uint8_t { deny, write };

struct Line {
  std::string name;
  std::string port;  ///< /dev/…, a pty's path, or tcp://host:port
  SerialSettings serial;
  std::string protocol;
  bool tcp = false;  ///< its protocol knows TCP only: `serial` is nobody's setting, and not shown
  Timing timing;     ///< line before gateway
  int retries = 2;   ///< of exchanges that may be repeated
  Echo echo = Echo::off;
  Ask ask = Ask::deny;
  AlarmSetting alarms;  ///< of the line itself; line before gateway
  Options options;
  std::vector<Device> devices;
  std::optional<PortServer> serial_server;  ///< without devices; `protocol` may be empty then
  std::optional<PortServer> lend;           ///< a client may have the port for a while
  Mark mark;

  /// Where clients come for the port; null: nowhere.
  const PortServer* server() const {
    return serial_server ? &*serial_server : lend ? &*lend : nullptr;
  }

  /// Its port is a serial server elsewhere.
  bool is_network() const { return port.starts_with("tcp://"); }
};

template <typename Visit>
void VisitFields(const Line*, Visit visit) {
  visit(Field<&Line::name>());
  visit(Field<&Line::port>());
  visit(Field<&Line::serial>());
  visit(Field<&Line::protocol>());
  visit(Derived<&Line::tcp>());
  visit(Field<&Line::timing>());
  visit(Field<&Line::retries>());
  visit(Field<&Line::echo>());
  visit(Field<&Line::ask>());
  visit(Field<&Line::alarms>());
  visit(Field<&Line::options>());
  visit(Field<&Line::devices>());
  visit(Field<&Line::serial_server>());
  visit(Field<&Line::lend>());
  visit(Derived<&Line::mark>());
}

}  // namespace baudgate::config
