// The history of a point reduced to what a chart of so many pixels can show: minimum, mean and
// maximum of each step. Short times from every kept value, long ones from minutes and hours.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "gateway/records/history/history_source.h"

namespace baudgate::history {

inline constexpr std::int64_t kMostPixels = 4096;

struct ChartQuery {
  std::string point{};  ///< LINE.DEVICE.POINT
  Millis since = 0;
  Millis until = 0;  ///< not in it any more; at most now
  std::int64_t pixels = 1200;
};

struct Chart {
  Millis step = 0;
  std::vector<Trend> rows{};  ///< by time; of steps without a good value none
  bool known = false;         ///< some file has the point
};

Result<Chart> ReadChart(const HistorySource& source, const ChartQuery& query);

}  // namespace baudgate::history
