// Records that a gateway keeps, page by page: all that are there and, if wanted, what comes. For
// `baudgate writes`, `baudgate events` and `baudgate alarms`. RunEvents, RunAlarms, RunAck and
// RunWrites are the commands.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <ostream>
#include <string>

#include "gateway/base/time.h"
#include "gateway/tools/cli/client/control_client.h"

namespace baudgate::tools {

/// A field as it may be shown; empty where it is not there.
std::string FieldText(const ControlClient::Json& record, const char* key);

// `baudgate events`: what has happened in devices, oldest first.
struct EventsOptions {
  bool follow = false;    ///< then what comes
  std::int64_t from = 1;  ///< the first number
  std::string device{};   ///< DEVICE or LINE.DEVICE; empty: all
  std::optional<WallTime> since{};
  bool json = false;
  bool csv = false;
  std::string socket{};               ///< empty: the gateway in the default places
  std::optional<Duration> seconds{};  ///< of `follow`, for tests: end after this time
  std::size_t width = 0;              ///< of the table, characters a line; 0: no limit
};

/// Exit code 0, also where nothing has happened yet, which is said; 4 when no gateway answers, or
/// it keeps no events; 2 there is no such device.
int RunEvents(const EventsOptions& options, std::ostream& out, std::ostream& err);

// `baudgate alarms` lists active and unacknowledged alarms, `baudgate ack` acknowledges them.
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

// `baudgate writes`: the audit, one record a write, oldest first.
struct WritesOptions {
  bool follow = false;  ///< then what comes, each when it has ended
  std::optional<WallTime> since{};
  bool json = false;
  std::string socket{};               ///< empty: the gateway in the default places
  std::optional<Duration> seconds{};  ///< of `follow`, for tests: end after this time
  std::size_t width = 0;              ///< of the table, characters a line; 0: no limit
};

/// Exit code 0, also where nothing was written yet, which is said; 4 when no gateway answers, or it
/// keeps no records.
int RunWrites(const WritesOptions& options, std::ostream& out, std::ostream& err);

}  // namespace baudgate::tools
