// `EventRecord` is one event as stored in events.db. docs/events.md describes its fields. An event
// is first a DeviceEvent in an EventBatch (protocols), then it is in ReportedEvents (gateway/bus),
// then it is an EventRecord in a Batch (gateway/records/events), and last a FedEvent for outputs.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/device.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"
#include "gateway/records/events/alarm.h"
#include "protocols/conversation.h"

namespace baudgate::events {

// `Place` computes the full time of an event and the quality of this time. A device may report only
// a part of the time ("12.345" seconds of a minute). The gateway adds when it received the event,
// and the greatest age that the event can have (`oldest`). `Place` reads no clock, so steps of the
// wall clock do not matter. All events of this table are received at 10:00:00.300:
//
//   reported 59.900, oldest 1 s    09:59:59.900  device
//   reported 59.900, oldest 5 min  09:59:59.900  minute_guessed: 09:58:59.900 would fit as well
//   reported 30.000, oldest 1 s    09:59:30.000  out_of_step: older than `oldest` allows
//   no time reported               10:00:00.300  none

/// The clock of a time, and the quality of that clock. The numbers are public (file, JSON, Modbus,
/// DDS), so new ones are appended.
enum class ClockQuality : std::uint16_t {
  none = 0,  ///< the device reported no time: the time is when the gateway received the event
  gateway = 1,
  device = 2,  ///< the device's clock; the reported time is complete, or only one minute fits
  minute_guessed = 3,  ///< the device's clock; several minutes fit, and the last is taken
  out_of_step = 4,     ///< the device's clock; no minute agrees with the gateway's clock
};
inline constexpr std::size_t kClockQualities = 5;
std::string_view Name(ClockQuality quality);
ClockQuality ClockQualityOf(std::int64_t number);

/// Tolerated difference between a device's clock and the gateway's, in both directions.
inline constexpr Duration kClockTolerance = std::chrono::seconds(2);

struct PlacedTime {
  WallTime time{};
  ClockQuality quality = ClockQuality::none;
};

/// Returns the times of the events of one batch, in their order. An event is at most
/// kClockTolerance later than the next event, unless the device's clock is out of step. `oldest`:
/// the greatest age that an event can have at `received`; empty: not known.
std::vector<PlacedTime> Place(const std::vector<std::optional<protocols::SaidTime>>& said,
                              WallTime received, std::optional<Duration> oldest);

// A record contains values that are saved and read as a unit: what a relay has recorded of a trip,
// the billing values of a month, the content of a transponder. docs/events.md describes the fields
// for users.
//
//   kind event, seq 7: event 413, "trip", read 12:00:03: trip_phases 4, record1_current_l1 5.2, …
//   kind billing, seq 31: meter-1, "month", device_time 2026-11-01: energy_t1 812.4 kWh, …
//
// A record is not stored in part: unless all its points were read, it counts as not read. Points
// that the device has reported as not existing are left out of this rule.

/// The kinds of records. The names are public (file, JSON). Each kind has its own number sequence.
inline constexpr std::string_view kEventRecord = "event";
inline constexpr std::string_view kBillingRecord = "billing";
/// Content of a transponder; it belongs to no event.
inline constexpr std::string_view kTagRecord = "tag";

enum class RecordState : std::uint8_t {
  read,
  not_read,    ///< reading has failed for good; `text` contains the reason
  superseded,  ///< a later event with the same record came before the values were read
};
inline constexpr std::size_t kRecordStates = 3;
std::string_view Name(RecordState state);

struct RecordValue {
  std::string name;
  Value value;
  std::string unit{};
  Quality quality = Quality::good;
};

struct KeptRecord {
  std::string kind{};
  std::int64_t seq = 0;  ///< number within the kind, from 1 without gaps; 0: not in the file yet
  std::string line{};
  std::string device{};
  std::string name{};      ///< name of the record: "trip", "month"
  std::int64_t event = 0;  ///< number of the event that the record belongs to; 0: no event
  WallTime device_time{};  ///< time of the values; `clock` tells by which clock
  ClockQuality clock = ClockQuality::none;
  WallTime read{};  ///< when the values were read, by the gateway's clock
  RecordState state = RecordState::read;
  std::string text{};  ///< why the record was not read, or why its values are doubtful
  std::vector<RecordValue> values{};
};

/// An event whose record is still to be read. It is stored, so that the record is read after a
/// restart too.
struct OwedRecord {
  std::int64_t event = 0;
  std::string line{};
  std::string device{};
  std::string name{};
  WallTime device_time{};  ///< time of the event; `clock` tells by which clock
  ClockQuality clock = ClockQuality::none;
};

struct EventRecord {
  /// Number of the event, from 1 without gaps, over restarts; 0: not in the file yet.
  std::int64_t seq = 0;
  WallTime received{};
  WallTime device_time{};
  ClockQuality clock = ClockQuality::none;
  std::string line;
  std::string device;
  std::uint32_t channel = 0;
  std::uint32_t code = 0;
  config::EventState state = config::EventState::message;
  std::string text;
  /// The name of the event's alarm, or of the point's rule that made the event: "2:17", "current_l1
  /// above 5", "no answer". Empty: the event has neither. Not stored in the file.
  std::string subject{};
  AlarmMark mark{};
  /// The name of the record that belongs to the event; empty: no record belongs to it. The values
  /// of the record are in `kept`, or are still to be read.
  std::string record{};
  std::optional<KeptRecord> kept{};  ///< the values of `record`, written in the event's transaction
  std::optional<Alarm> alarm{};      ///< the alarm after this event; empty: unchanged, or no alarm
};

/// Returns the priority of the event's alarm; none: the event belongs to no alarm.
config::AlarmPriority PriorityOf(const EventRecord& record);

/// The names of priorities of events in the file and in JSON.
inline constexpr std::array<std::string_view, config::kAlarmPriorities> kEventPriorities = {
    "none", "low", "medium", "high"};

/// The limit of EventRecord::text and Alarm::text, in bytes.
inline constexpr std::size_t kLongestText = 128;

/// Cuts a UTF-8 text to kLongestText bytes or less, at the end of a character.
void Shorten(std::string& text);

/// Makes an EventRecord of each event of a batch, with the texts of the device's profile. `oldest`:
/// see Place.
std::vector<EventRecord> RecordsOf(const protocols::EventBatch& batch, const std::string& line,
                                   const config::Device& device, WallTime received,
                                   std::optional<Duration> oldest);

}  // namespace baudgate::events
