// One event as it is kept for ever. docs/events.md has the fields for users. On its way an event is
// a DeviceEvent in an EventBatch (protocols), ReportedEvents (poll), an EventRecord in a Batch
// (here), and a FedEvent for outputs. PlacedTime is the time of an event, and KeptRecord holds
// values that are saved and read as one.
// SPDX-License-Identifier: Apache-2.0
#pragma once

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

// The time of an event. A device reports part of it ("12.345" of a minute); the gateway knows when
// it received the event, and since when the device had no other. From these follow the time and how
// sure it is. No clock is read here, and steps of the wall clock in between change nothing.
//
//   said 59.900, received 10:00:00.300, oldest 1 s   09:59:59.900  device
//   said 59.900, received 10:00:00.300, oldest 5min  09:59:59.900  minute_guessed: or 09:58:59.900
//   … said 30.000, received 10:00:00.300, oldest 1 s   09:59:30.000  out_of_step: it was not then
//   nothing said, received 10:00:00.300              10:00:00.300  none

/// The clock of a time, and how good it is. The numbers are public: in the file, in JSON, on Modbus
/// and DDS; new ones are appended.
enum class ClockQuality : std::uint16_t {
  none = 0,            ///< the device reported no time: it is when the gateway received it
  gateway = 1,         ///< the gateway's own
  device = 2,          ///< the device's; whole, or only one minute fits
  minute_guessed = 3,  ///< the device's; the last of several minutes that fit
  out_of_step = 4,     ///< the device's; no minute agrees with the gateway's clock
};
inline constexpr std::size_t kClockQualities = 5;
std::string_view Name(ClockQuality quality);       ///< "minute guessed"
ClockQuality ClockQualityOf(std::int64_t number);  ///< none where there is no such

/// A device's clock may be this far ahead of the gateway's, or behind it.
inline constexpr Duration kClockTolerance = std::chrono::seconds(2);

struct PlacedTime {
  WallTime time{};
  ClockQuality quality = ClockQuality::none;
};

/// The times of one batch, in order: an event is no older than the one before it, as far as its
/// clock allows. `oldest`: no event is older; empty: not known.
std::vector<PlacedTime> Place(const std::vector<std::optional<protocols::SaidTime>>& said,
                              WallTime received, std::optional<Duration> oldest);

// Values that belong together, saved and read as one: what a relay has recorded of a trip, the
// billing values of a month, the content of a transponder. docs/events.md has the fields for users.
//
//   kind event, seq 7: of event 413, "trip", read 12:00:03: trip_phases 4, record1_current_l1 5.2
//   xIn, … kind billing, seq 31: of meter-1, "month", device_time 2026-11-01: energy_t1 812.4 kWh,
//   …
//
// Never in part: if some of its values are missing, a record counts as not read.

/// The kinds are users': in the file and in JSON. Each has numbers of its own.
inline constexpr std::string_view kEventRecord = "event";      ///< read after an event
inline constexpr std::string_view kBillingRecord = "billing";  ///< of a meter
inline constexpr std::string_view kTagRecord = "tag";  ///< of a transponder, without an event

/// The words of users are Name's.
enum class RecordState : std::uint8_t {
  read,
  not_read,    ///< given up; `text` says why
  superseded,  ///< another event with this record came before it was read
};
inline constexpr std::size_t kRecordStates = 3;
std::string_view Name(RecordState state);  ///< "not read"

struct RecordValue {
  std::string name;
  Value value;
  std::string unit{};
  Quality quality = Quality::good;
};

struct KeptRecord {
  std::string kind{};    ///< one of the above
  std::int64_t seq = 0;  ///< of its kind, from 1 on without a gap; 0: it is not in the file yet
  std::string line{};
  std::string device{};
  std::string name{};      ///< "trip", "month"
  std::int64_t event = 0;  ///< number of the event that it belongs to; 0: of none
  WallTime device_time{};  ///< the time of the values, by the clock that `clock` names
  ClockQuality clock = ClockQuality::none;
  WallTime read{};  ///< by the gateway's clock
  RecordState state = RecordState::read;
  std::string text{};  ///< why it was not read, or why it is doubtful
  std::vector<RecordValue> values{};
};

/// An event whose record is still to be read, also after a restart.
struct OwedRecord {
  std::int64_t event = 0;
  std::string line{};
  std::string device{};
  std::string name{};
  WallTime device_time{};  ///< of the event, as `clock`
  ClockQuality clock = ClockQuality::none;
};

struct EventRecord {
  std::int64_t seq = 0;  ///< from 1 on without a gap, over restarts; 0: it is not in the file yet
  WallTime received{};
  WallTime device_time{};
  ClockQuality clock = ClockQuality::none;
  std::string line;
  std::string device;
  std::uint32_t channel = 0;
  std::uint32_t code = 0;
  config::EventState state = config::EventState::message;
  std::string text;
  /// In an event of the gateway: the part of the device, "current_l1 above 5"; not in the file.
  /// Also the name of its alarm.
  std::string subject{};
  AlarmMark mark{};
  /// The name of the values that belong to it: they are in `kept`, or still to be read. Empty:
  /// none.
  std::string record{};
  std::optional<KeptRecord> kept{};  ///< written with it, in one transaction
  std::optional<Alarm> alarm{};  ///< its state after this event; empty: as before, or there is none
};

/// Longer texts are cut.
inline constexpr std::size_t kLongestText = 128;

/// Cuts to kLongestText, without half a character at the end.
void Shorten(std::string& text);

/// Makes records with the texts of the device's profile. `oldest`: see Place.
std::vector<EventRecord> RecordsOf(const protocols::EventBatch& batch, const std::string& line,
                                   const config::Device& device, WallTime received,
                                   std::optional<Duration> oldest);

}  // namespace baudgate::events
