// What goes from the recorder to the files: kept entries, spans that have ended, and the runs that
// they belong to.
//
// A run is a stretch of time in which the history knows of every change: it begins when the gateway
// starts, when values were dropped, when the clock of the machine was set. Between two runs nothing
// is known. Within a run the times of a point rise; the numbers of runs rise for ever, whatever the
// clock says.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/point.h"
#include "gateway/records/history/entry.h"
#include "gateway/records/history/rollup.h"

namespace baudgate::history {

/// Why there is a gap before a run.
enum class RunBegin : std::uint8_t { started, dropped, clock, standstill };
inline constexpr std::array<std::string_view, 4> kRunBegins = {"started", "dropped", "clock",
                                                               "standstill"};
inline std::string_view Name(RunBegin why) { return kRunBegins[static_cast<std::size_t>(why)]; }

struct Run {
  std::int64_t number = 0;  ///< from 1 on; of the recorder: since the start of the gateway
  Millis began = 0;
  Millis until = 0;  ///< everything is known until then
  RunBegin why = RunBegin::started;
};

using PointNumber = std::uint32_t;  ///< in config::History::points

struct Sample {
  PointNumber point = 0;
  std::int64_t run = 0;
  Entry entry{};
};

struct TrendRow {
  PointNumber point = 0;
  std::int64_t run = 0;
  Millis width = kMinute;  ///< or kHour
  Trend trend{};
};

struct Batch {
  std::vector<Run> runs;  ///< by number; of each as it is now
  std::vector<Sample> samples;
  std::vector<TrendRow> trends;

  bool empty() const { return runs.empty() && samples.empty() && trends.empty(); }
  /// The newest word on a run counts.
  void SetRun(const Run& run);
  void Append(Batch&& later);
};

struct PointName {
  std::string name;  ///< LINE.DEVICE.POINT
  config::Type type = config::Type::float32;
};

}  // namespace baudgate::history
