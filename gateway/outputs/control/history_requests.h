// The requests `history` and `kept_points` of the control socket. Part of record_requests.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/outputs/status/status_json.h"
#include "gateway/records/events/event_source.h"
#include "gateway/records/history/history_source.h"

namespace baudgate::control {

/// Where values are kept; null: nowhere.
struct KeptValues {
  const config::Config& config;
  const history::HistorySource* history = nullptr;
  const events::EventSource* events = nullptr;
};

/// One page of a point, or of what a meter has measured itself; or {"error":…}. A point that is not
/// configured any more still has its values; of one that has none it is said why.
Json HistoryPage(const Json& request, const KeptValues& kept);

/// {"points":["bay-1.feeder-1.current_l1"]}: whose values are kept, of those that a pattern means.
/// By the configuration: a point that is not in it any more has to be named.
Json KeptPoints(const Json& request, const KeptValues& kept);

}  // namespace baudgate::control
