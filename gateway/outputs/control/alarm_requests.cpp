// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/control/alarm_requests.h"

#include <algorithm>

#include "gateway/base/spelling.h"
#include "gateway/base/text.h"
#include "gateway/outputs/status/events_json.h"
#include "gateway/outputs/status/target.h"

namespace baudgate::control {
namespace {

/// LINE[.DEVICE[.POINT]]; points have no dot, nor have lines and devices.
Result<events::AckQuery> Named(const std::string& target) {
  const auto parts = Split(target, '.');
  if (parts.empty() || parts[0].empty() || parts.size() > 3) {
    return Error{config::Quoted(target) +
                 " is no alarm: write LINE, LINE.DEVICE, LINE.DEVICE.POINT or the number of an "
                 "event"};
  }
  events::AckQuery query;
  query.line = parts[0];
  if (parts.size() > 1) query.device = parts[1];
  if (parts.size() == 3) query.point = parts[2];
  return query;
}

/// As `alarms` shows it: what is of no line has other names.
std::optional<events::AckQuery> Shown(const std::vector<events::Alarm>& alarms,
                                      const std::string& target) {
  const auto found = std::ranges::find(alarms, target, events::PlaceOf);
  if (found == alarms.end()) return std::nullopt;
  events::AckQuery query;
  query.line = found->line;
  query.device = found->device;
  query.point = found->point;
  return query;
}

}  // namespace

Json AlarmsPage(const events::EventSource& events, std::int64_t after) {
  std::vector<events::Alarm> alarms = events.Alarms();
  std::ranges::sort(alarms, {}, &events::Alarm::seq);
  std::erase_if(alarms, [after](const events::Alarm& alarm) { return alarm.seq <= after; });
  Json page = {{"records", Json::array()}, {"next", after}, {"more", false}};
  for (const events::Alarm& alarm : alarms) {
    page["more"] = page["records"].size() == events::kPage;
    if (page["more"]) break;
    page["records"].push_back(AlarmJson(alarm));
    page["next"] = alarm.seq;
  }
  return page;
}

Result<events::AckQuery> FindAlarms(const config::Config& config, const events::EventSource& events,
                                    const std::string& target) {
  const std::vector<events::Alarm> alarms = events.Alarms();
  events::AckQuery query;
  if (const auto seq = ParseInteger<std::int64_t>(target)) {
    query.seq = *seq;
    if (std::ranges::find(alarms, *seq, &events::Alarm::seq) != alarms.end()) return query;
    return Error{"event " + target + " has raised no alarm that is still there; see 'alarms'"};
  }
  if (auto shown = Shown(alarms, target)) return *shown;
  const auto named = Named(target);
  if (!named) return named;
  if (std::ranges::any_of(alarms, [&](const auto& alarm) { return named->Means(alarm); })) {
    return named;
  }
  if (named->point.empty()) {
    const auto found = FindTarget(config, target);
    if (!found) return Error{found.error()};
  } else if (const auto found = FindPoint(config, target); !found) {
    return Error{found.error()};
  }
  return named;
}

Json AckJson(const events::Acknowledged& done) {
  return {{"ok", true}, {"acknowledged", done.alarms}, {"trouble", done.trouble}};
}

}  // namespace baudgate::control
