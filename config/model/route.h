// Where requests for units that are no devices go.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "config/model/alarm_setting.h"
#include "config/model/fields.h"
#include "config/model/mark.h"
#include "gateway/base/time.h"

namespace baudgate::config {

/// Where requests for some units go as they are: to a line, or to a Modbus TCP server elsewhere.
/// Units of devices come first, then the first route that names the unit.
struct Route {
  std::uint8_t first = 1;  ///< unit ids, 0…255; 0 only when it is written
  std::uint8_t last = 1;
  std::string line;            ///< name of a line whose protocol carries Modbus, or empty
  std::size_t line_index = 0;  ///< in Config::lines, when `line` is not empty
  std::string host;            ///< of the server, when `line` is empty
  std::uint16_t port = 502;
  std::optional<std::uint8_t> remap;  ///< `first` becomes this address, the next unit the next
  /// From the request's arrival to the end of its reply, queueing included; not sent later.
  Duration deadline = std::chrono::milliseconds(2500);
  AlarmSetting alarms;  ///< of each unit behind it; route before line and gateway
  Mark mark;

  bool Covers(std::uint8_t unit) const { return unit >= first && unit <= last; }
  /// The address on the line, or the unit id at the server.
  std::uint8_t SlaveOf(std::uint8_t unit) const;
  /// "33-40".
  std::string Units() const;
  /// "line drive" or "server 10.0.0.9:502".
  std::string Target() const;
};

template <typename Visit>
void VisitFields(const Route*, Visit visit) {
  visit(Field<&Route::first>{"units"});
  visit(Field<&Route::last>{"units"});
  visit(Field<&Route::line>());
  visit(Derived<&Route::line_index>());
  visit(Field<&Route::host>());
  visit(Field<&Route::port>());
  visit(Field<&Route::remap>());
  visit(Field<&Route::deadline>());
  visit(Field<&Route::alarms>());
  visit(Derived<&Route::mark>());
}

}  // namespace baudgate::config
