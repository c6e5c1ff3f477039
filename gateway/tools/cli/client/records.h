// `baudgate events`, `alarms` and `writes` print records of a running gateway page by page, and
// with `follow` also new records as they come. `baudgate ack` acknowledges alarms.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <ostream>
#include <string>

#include "gateway/base/time.h"
#include "gateway/tools/cli/client/control_client.h"

namespace baudgate::tools {

std::string FieldText(const ControlClient::Json& record, const char* key);

struct EventsOptions {
  bool follow = false;
  std::int64_t from = 1;   ///< the number of the first event to print
  std::string device{};    ///< DEVICE or LINE.DEVICE; empty: all devices
  std::string priority{};  ///< high, medium, low, none; empty: all events
  std::optional<WallTime> since{};
  bool json = false;
  bool csv = false;
  std::string socket{};  ///< path of the control socket; empty: the only running gateway is used
  std::optional<Duration> seconds{};  ///< for tests, with `follow`: end after this time
  std::size_t width = 0;
};

/// Exit codes: 0, also if there are no events; 2 unknown device; 4 no gateway answers, or it
/// records no events.
int RunEvents(const EventsOptions& options, std::ostream& out, std::ostream& err);

struct AlarmsOptions {
  bool json = false;
  bool follow = false;   ///< true: go on, and print each alarm again whenever it changes
  std::string socket{};  ///< path of the control socket; empty: the only running gateway is used
  std::size_t width = 0;
};
/// Exit codes: 0, also if there are no alarms; 4 no gateway answers, or its disk fails.
int RunAlarms(const AlarmsOptions& options, std::ostream& out, std::ostream& err);

struct AckOptions {
  std::string target;    ///< LINE, LINE.DEVICE, LINE.DEVICE.POINT, or the number of an event
  std::string socket{};  ///< path of the control socket; empty: the only running gateway is used
};
/// Exit codes: 2 unknown device, point or alarm; else those of RunAlarms.
int RunAck(const AckOptions& options, std::ostream& out, std::ostream& err);

// `baudgate writes`: prints the audit records, oldest first.
struct WritesOptions {
  bool follow = false;
  std::optional<WallTime> since{};
  bool json = false;
  std::string socket{};  ///< path of the control socket; empty: the only running gateway is used
  std::optional<Duration> seconds{};  ///< for tests, with `follow`: end after this time
  std::size_t width = 0;
};

/// Exit codes: 0, also if there are no writes; 4 no gateway answers, or it records no writes.
int RunWrites(const WritesOptions& options, std::ostream& out, std::ostream& err);

}  // namespace baudgate::tools
