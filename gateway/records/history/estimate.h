// How many bytes a configuration will keep, before it runs: for `baudgate check`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "config/model/config.h"

namespace baudgate::history {

struct Estimate {
  std::uint64_t least = 0;    ///< bytes a day when nothing changes
  std::uint64_t most = 0;     ///< bytes a day when every reading is another one
  std::uint64_t minutes = 0;  ///< bytes of trends.db, once it has all minutes that it keeps

  /// Until the limit is reached, with so many bytes a day.
  std::uint64_t Days(std::uint64_t limit, std::uint64_t bytes_a_day) const;
};

/// By what was measured (docs/performance.md).
Estimate EstimateOf(const config::Config& config);

}  // namespace baudgate::history
