// `baudgate events`: what has happened in devices, oldest first.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <ostream>
#include <string>

#include "gateway/base/time.h"

namespace baudgate {

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

}  // namespace baudgate
