// `PointWatch` makes events from the readings of a point, by one rule. No clock, no lock, no disk.
//
//   above 5, hysteresis 1:   4 6 5 4         on at 6, off at 4
//   above 5, delay 3 s:      6 6 6 6         on at the reading that is 3 s after the first 6
//   change:                  1 1 2 bad 2 3   message at 2 and at 3
//   change, normal 0:        0 16 17 0       on at 16 and at 17, off at 0
//
// A bad reading makes no event and does not end a delay. The first good reading since the start
// makes an event if a limit is exceeded. If the point has an alarm, the first reading is always
// passed on, and becomes an event if the stored state of the alarm differs (AlarmMark::first).
// Between limit and hysteresis the first state is not known.
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

class PointWatch {
 public:
  explicit PointWatch(const config::PointEvent& rule) : rule_(rule) {}

  struct Transition {
    config::EventState state = config::EventState::message;
    bool first = false;
  };
  std::optional<Transition> Take(const Value& value, Quality quality, Instant now);
  /// Takes over the state of `before`, if its rule is the same.
  void GoOn(const PointWatch& before);

 private:
  std::optional<Transition> Compare(const Decimal& value, Instant now);
  std::optional<Transition> Change(const Value& value, Instant now);
  bool IsNormal(const Value& value) const;
  bool IsSame(const Value& a, const Value& b) const;
  /// True if the new state has lasted for the delay of the rule.
  bool Lasts(const Value& seen, Instant now);

  const config::PointEvent& rule_;
  Value told_;  // last reported value; for a limit: whether it is exceeded; empty: not known
  Value seen_;  // a differing value whose delay is running
  std::optional<Instant> since_;  // start of that delay
};

/// `DeviceWatch` applies all rules of one device.
class DeviceWatch {
 public:
  DeviceWatch(std::string line, std::shared_ptr<const config::Device> device);

  /// Takes over the state of points and rules that are unchanged from `before`, which watched the
  /// device of this name until its line was restarted.
  void GoOn(const DeviceWatch& before);
  bool Watches(std::uint32_t point) const { return rules_.contains(point); }
  /// Returns the events that a reading of `point` makes. `at`: the time of the reading.
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
  std::map<std::uint32_t, std::vector<Rule>> rules_;  // key: index of the point
};

/// Returns the subject of the rule's events: "current_l1 above 5".
std::string SubjectOf(const config::Point& point, const config::PointEvent& event);

}  // namespace baudgate::events
