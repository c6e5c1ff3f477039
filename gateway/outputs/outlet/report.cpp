// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/outlet/report.h"

#include <fmt/format.h>

namespace baudgate::outlet {
namespace {

std::string TimeOf(history::Millis time) { return FormatWallTime(history::ToWall(time)); }

}  // namespace

nlohmann::ordered_json SectionOf(const ForwarderState& state) {
  using Json = nlohmann::ordered_json;
  Json advice = Json::array();
  if (!state.has_history) {
    advice.push_back("no values are sent, because the configuration has no history");
  }
  if (!state.trouble.empty()) {
    advice.push_back(state.trouble_since ? fmt::format("{} (since {})", state.trouble,
                                                       FormatWallTime(*state.trouble_since))
                                         : state.trouble);
  }
  if (state.put_aside > 0) {
    advice.push_back(fmt::format("{} values were refused and are not sent again; the last: {}",
                                 state.put_aside, state.refused));
  }
  Json gap = nullptr;
  if (state.last_gap) {
    gap = {{"from", TimeOf(state.last_gap->from)},
           {"until", TimeOf(state.last_gap->until)},
           {"why", state.last_gap->why}};
    advice.push_back(fmt::format("values from {} to {} could not be sent: {}",
                                 TimeOf(state.last_gap->from), TimeOf(state.last_gap->until),
                                 state.last_gap->why));
  }
  return {{"behind_s", std::chrono::duration_cast<std::chrono::seconds>(state.behind).count()},
          {"sent", state.sent},
          {"confirmed", state.confirmed},
          {"refused", state.put_aside},
          {"gaps", state.gaps},
          {"last_gap", std::move(gap)},
          {"advice", std::move(advice)}};
}

OutletAlarms AlarmsOf(const ForwarderState& state, WallTime now) {
  constexpr Duration kRefusedFor = 1h;
  OutletAlarms alarms;
  if (state.behind >= kLongAway) {
    alarms.away = state.trouble.empty() ? "values wait to be sent" : state.trouble;
  }
  if (state.refused_at && now - *state.refused_at < kRefusedFor) alarms.refused = state.refused;
  return alarms;
}

std::vector<outputs::Series> SeriesOf(const MetricNames& names, const ForwarderState& state) {
  return {{{names.behind, "gauge", "Age of the place up to which all values are confirmed."},
           std::chrono::duration<double>(state.behind).count()},
          {{names.confirmed, "counter", "Values that the receiver has confirmed."},
           static_cast<double>(state.confirmed)},
          {{names.refused, "counter", "Values that the receiver has refused for good."},
           static_cast<double>(state.put_aside)},
          {{names.gaps, "counter", "Spans whose values were deleted or damaged before."},
           static_cast<double>(state.gaps)}};
}

}  // namespace baudgate::outlet
