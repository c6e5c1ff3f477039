// `baudgate writes`: the audit, one record a write, oldest first.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <ostream>
#include <string>

#include "gateway/base/time.h"

namespace baudgate {

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

}  // namespace baudgate
