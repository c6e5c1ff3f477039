// The topics of the gateway at the broker and the payloads of its messages, as pure functions.
// docs/mqtt.md describes them for users.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/records/events/alarm.h"
#include "gateway/records/events/event_record.h"

namespace baudgate::mqtt {

// Topics builds the topics from the pattern of the configuration.
class Topics {
 public:
  explicit Topics(const config::Config& config);

  /// Returns a topic of the gateway itself: "baudgate/gate-1/status".
  std::string Own(std::string_view leaf) const { return own_ + std::string(leaf); }
  /// Returns e.g. "baudgate/gate-1/bay-1/feeder-1/current_l1".
  std::string Of(const std::string& line, const std::string& device,
                 const std::string& point) const;
  /// Returns the filter that matches the topic of each point: "baudgate/gate-1/+/+/+".
  std::string Filter() const;
  /// True if no point of another gateway can match Filter().
  bool filter_is_own() const { return filter_is_own_; }

 private:
  std::string own_;
  std::string pattern_;  ///< with {line}, {device} and {point} only
  bool filter_is_own_ = false;
};

/// A value as it is published.
struct Reading {
  Value value{};
  Quality quality = Quality::bad_waiting;
  std::optional<WallTime> time{};  ///< when the value was read; empty: never
};

/// Returns the reading of a point now.
Reading ReadingOf(const bus::DeviceRecord& record, std::size_t point, Instant now);

/// Returns "good", "uncertain" or "bad".
std::string_view QualityWord(Quality quality);
/// Returns what follows the quality's word in texts for people: "sensor failure, open sensor";
/// empty for good.
std::string ReasonText(Quality quality);

/// Returns the payload of a point. With Payload::json:
///
///   {"value":12.25,"quality":"good","reason":"","time":"2026-11-21T01:14:31.250Z","unit":"A",
///    "seq":1790000000000}
///
/// The value of a bad reading is null. With Payload::value it is only "12.25", and "unavailable"
/// unless the quality is good, because the payload has no place for the quality.
std::string PointPayload(config::Mqtt::Payload payload, const std::string& unit,
                         const Reading& reading, std::int64_t seq);

/// Returns the event in the form of `baudgate events --json`.
std::string EventPayload(const events::EventRecord& record);

/// Returns the alarms as a JSON list, the worst first; at most kMostAlarms.
inline constexpr std::size_t kMostAlarms = 500;
std::string AlarmsPayload(std::vector<events::Alarm> alarms);

}  // namespace baudgate::mqtt
