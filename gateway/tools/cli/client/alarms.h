// `baudgate alarms` lists active and unacknowledged alarms, `baudgate ack` acknowledges them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ostream>
#include <string>

namespace baudgate {

struct AlarmsOptions {
  bool json = false;
  bool follow = false;    ///< go on: each alarm once more whenever it has changed
  std::string socket{};   ///< empty: the gateway in the default places
  std::size_t width = 0;  ///< of the table, characters a line; 0: no limit
};
/// Exit code 0, also where there is none, which is said; 4 when no gateway answers, or its disk
/// fails.
int RunAlarms(const AlarmsOptions& options, std::ostream& out, std::ostream& err);

struct AckOptions {
  std::string target;    ///< LINE, LINE.DEVICE, LINE.DEVICE.POINT or the number of an event
  std::string socket{};  ///< as above
};
/// The same; 2 where there is no such device, point or alarm.
int RunAck(const AckOptions& options, std::ostream& out, std::ostream& err);

}  // namespace baudgate
