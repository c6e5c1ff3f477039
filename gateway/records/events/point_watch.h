// `PointWatch` makes events from the readings of a point, by one rule. `DeviceWatch` applies all
// rules of one device. No clock, no lock, no disk.
//
//   above 5, hysteresis 1:   4 6 5 4         on at 6, off at 4
//   above 5, delay 3 s:      6 6 6 6         on at the reading that is 3 s after the first 6
//   change:                  1 1 2 bad 2 3   message at 2 and at 3
//   change, normal 0:        0 16 17 0       on at 16 and at 17, off at 0
//
// A bad reading makes no event and does not end a delay. The first good reading since the start
// makes an event only if the limit is exceeded or the value is not the normal one. If the point has
// an alarm, the event of the first reading is always made, and dropped later if the stored alarm is
// already in that state (AlarmMark::first). A first reading between limit and hysteresis makes no
// event.
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
  /// Continues with the state of `before`, if both have the same rule.
  void GoOn(const PointWatch& before);

 private:
  std::optional<Transition> Compare(const Decimal& value, Instant now);
  std::optional<Transition> Change(const Value& value, Instant now);
  bool IsNormal(const Value& value) const;
  bool IsSame(const Value& a, const Value& b) const;
  bool Lasts(const Value& seen, Instant now);

  const config::PointEvent& rule_;
  Value told_;  // last reported value, or whether the limit is exceeded; empty: not known
  Value seen_;
  std::optional<Instant> since_;
};

class DeviceWatch {
 public:
  DeviceWatch(std::string line, std::shared_ptr<const config::Device> device);

  /// Continues with the state of the points and rules of `before` that are unchanged. `before`
  /// watched the device of this name until its line was restarted.
  void GoOn(const DeviceWatch& before);
  bool Watches(std::uint32_t point) const { return rules_.contains(point); }
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

/// Returns the name of the rule's alarm. Example: "current_l1 above 5".
std::string SubjectOf(const config::Point& point, const config::PointEvent& event);

}  // namespace baudgate::events
