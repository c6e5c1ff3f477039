// `SectionOf` and `SeriesOf` show the state of a forwarder: in the status document, and as metrics.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/outputs/outlet/outlet.h"
#include "gateway/outputs/series.h"

namespace baudgate::outlet {

/// Returns {"behind_s":0,"confirmed":120,"refused":0,"gaps":0,…,"advice":[…]}, which an output adds
/// to its section. `advice` has one sentence for each trouble.
nlohmann::ordered_json SectionOf(const ForwarderState& state);

/// Why an outlet needs an alarm. Empty: it needs none.
struct OutletAlarms {
  std::string away{};     ///< values have waited for more than kLongAway
  std::string refused{};  ///< values were refused in the last hour
};
inline constexpr Duration kLongAway = 10min;
OutletAlarms AlarmsOf(const ForwarderState& state, WallTime now);

/// Receives the alarms of an outlet again and again, on the forwarder's thread. Null: nobody does.
using TellAlarms = std::function<void(const OutletAlarms& alarms, Now now)>;

/// The names of an outlet's metrics: "baudgate_mqtt_behind_seconds" and so on.
struct MetricNames {
  std::string_view behind;
  std::string_view confirmed;
  std::string_view refused;
  std::string_view gaps;
};
inline constexpr std::size_t kMetrics = 4;

std::vector<outputs::Series> SeriesOf(const MetricNames& names, const ForwarderState& state);

}  // namespace baudgate::outlet
