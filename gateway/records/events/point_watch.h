// Makes events of the readings of a point. No clock, no lock, no disk.
//
//   above 5, hysteresis 1:   4 6 5 4     on at 6, off at 4
//   above 5, delay 3 s:      6 6 6 6     on at the first that is 3 s behind the one that began it
//   change:                  1 1 2 bad 2 3   at 2 and 3
//   change, normal 0:        0 16 17 0       on at 16 and at 17, off at 0
//
// A bad reading makes no event and ends no delay. The first good reading since the start makes one
// if a limit is exceeded; if the point has an alarm it is passed on in any case, and is an event if
// the kept state of the alarm differs (AlarmMark::first). Between limit and hysteresis the state is
// not known.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "config/model/device.h"
#include "gateway/base/value.h"
#include "gateway/records/events/event_record.h"

namespace baudgate::events {

/// One rule of one point.
class PointWatch {
 public:
  explicit PointWatch(const config::PointEvent& rule) : rule_(rule) {}

  struct Transition {
    config::EventState state = config::EventState::message;
    bool first = false;
  };
  std::optional<Transition> Take(const Value& value, Quality quality, Instant now);
  /// Knows what `before` knew; only if the rule is the same.
  void GoOn(const PointWatch& before);

 private:
  std::optional<Transition> Compare(const Decimal& value, Instant now);
  std::optional<Transition> Change(const Value& value, Instant now);
  bool IsNormal(const Value& value) const;
  bool IsSame(const Value& a, const Value& b) const;
  /// Whether the present state has lasted long enough.
  bool Lasts(const Value& seen, Instant now);

  const config::PointEvent& rule_;
  Value told_;                    // of a limit whether it is exceeded; empty: not known
  Value seen_;                    // another than that
  std::optional<Instant> since_;  // it is
};

/// All rules of one device.
class DeviceWatch {
 public:
  DeviceWatch(std::string line, std::shared_ptr<const config::Device> device);

  /// In place of `before`, which watched the device of this name until its line was restarted: what
  /// it knew of points and rules that are still the same is known.
  void GoOn(const DeviceWatch& before);
  bool Watches(std::uint32_t point) const { return rules_.contains(point); }
  /// `at`: of the reading.
  std::vector<EventRecord> Take(std::uint32_t point, const Value& value, Quality quality, Now at);

 private:
  struct Rule {
    const config::PointEvent& event;
    PointWatch watch;
  };
  EventRecord RecordOf(const config::Point& point, const config::PointEvent& event,
                       const PointWatch::Transition& found, const Value& value, Now at) const;

  const std::string line_;
  const std::shared_ptr<const config::Device> device_;
  std::map<std::uint32_t, std::vector<Rule>> rules_;  // by point
};

/// "current_l1 above 5": the subject of its events.
std::string SubjectOf(const config::Point& point, const config::PointEvent& event);

}  // namespace baudgate::events
