// Fixed events, alarms and history for the tests of the web output.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "gateway/records/events/event_source.h"
#include "gateway/records/history/history_view.h"

namespace baudgate::web {

inline constexpr history::Millis kDayBegin = 1'789'948'800'000;  // 2026-09-21T00:00:00Z

class FakeEvents final : public events::EventSource {
 public:
  events::EventsState state() const override {
    events::EventsState state;
    state.disk = records::Disk::fine;
    state.newest = 412;
    state.oldest = 1;
    state.alarms_active = 1;
    state.alarms_unacknowledged = 1;
    state.file = "/var/lib/baudgate/events.db";
    return state;
  }
  std::vector<events::Alarm> Alarms() const override {
    events::Alarm alarm;
    alarm.line = "bay-1";
    alarm.device = "feeder-1";
    alarm.point = "current";
    alarm.name = "current above 5";
    alarm.state = events::AlarmState::active;
    alarm.seq = 412;
    alarm.text = "current of feeder-1 is above 5 A";
    return {alarm};
  }
  std::size_t Acknowledge(const events::AckQuery& query,
                          std::function<void(const events::Acknowledged&)> done) override {
    by = query.by;
    done({1, {}, {}});
    return 1;
  }
  Result<events::Page> Read(const events::PageQuery& its) const override {
    query = its;
    events::EventRecord record;
    record.seq = 412;
    record.line = "bay-1";
    record.device = "feeder-1";
    record.text = "current of feeder-1 is above 5 A";
    return events::Page{{record}, 412, false};
  }
  Result<events::PastPage> ReadPast(const events::PastQuery&) const override {
    return events::PastPage{};
  }

  std::string by;
  mutable events::PageQuery query;
};

/// The history of a point that is read each second. Each minute has the values 10, 11, … 39, then
/// bad readings.
class FakeHistory final : public history::HistorySource {
 public:
  history::HistoryState state() const override { return {}; }
  Result<history::Page> Read(const history::PageQuery& query) const override {
    history::Page page;
    page.known = query.point == "bay-1.feeder-1.current";
    const history::Millis until = std::min(query.until, kDayBegin + 10 * history::kMinute);
    for (history::Millis time = kDayBegin; page.known && time < until; time += history::kSecond) {
      if (time <= query.after.time || time < query.since) continue;
      page.more = page.records.size() == history::kPage / 4;
      if (page.more) break;
      const history::Millis second = time / history::kSecond % 60;
      const bool good = second < 30;
      page.records.push_back(
          {{time, good ? Value(static_cast<double>(10 + second)) : Value(),
            good ? Quality(Quality::good) : Quality(Quality::bad_communication)}});
      page.next = {1, time};
    }
    return page;
  }
  Result<history::TrendPage> ReadTrends(const history::TrendQuery& query) const override {
    every = query.every;
    history::TrendPage page;
    page.known = query.point == "bay-1.feeder-1.current";
    history::Trend span;
    span.begin = history::FloorTo(query.since, query.every);
    span.mean = 24.5;
    span.min = 10;
    span.max = 39;
    span.good = query.every / 2;
    page.spans.push_back(span);
    return page;
  }

  mutable history::Millis every = 0;
};

}  // namespace baudgate::web
