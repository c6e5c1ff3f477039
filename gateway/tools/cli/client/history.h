// `baudgate history`: values that were kept, or what they come to, oldest first.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "gateway/base/time.h"

namespace baudgate {

struct HistoryOptions {
  std::vector<std::string> points{};  ///< LINE.DEVICE.POINT, or patterns with * and ?
  std::optional<WallTime> since{};
  std::optional<WallTime> until{};
  std::optional<Duration> every{};  ///< means, minima and maxima of so long; empty: the values
  bool json = false;
  bool csv = false;
  bool billing = false;   ///< see gateway/tools/cli/client/billing.h
  std::string socket{};   ///< empty: the gateway in the default places
  std::size_t width = 0;  ///< of tables, characters a line; 0: no limit
};

/// Exit code 0, also where there is nothing, which is said; 4 when no gateway answers, or it keeps
/// no values; 2 there is no such point, or its values are not kept.
int RunHistory(const HistoryOptions& options, std::ostream& out, std::ostream& err);

}  // namespace baudgate
