// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "config/model/history.h"
#include "gateway/records/history/entry.h"

namespace baudgate::history {

struct StoreLimits {
  std::uint64_t bytes = 1000 * config::kMegabyte;
  Millis keep = 365 * kDay;
  /// Rows of a day's file that become chunks before the hour is over.
  std::size_t open_rows = 1'500'000;
  std::size_t pack_each = 40'000;  ///< entries that are packed at a time
};

}  // namespace baudgate::history
