// Values that belong together, saved and read as one: what a relay has recorded of a trip, the
// billing values of a month, the content of a transponder. docs/events.md has the fields for users.
//
//   kind event, seq 7: of event 413, "trip", read 12:00:03: trip_phases 4, record1_current_l1 5.2
//   xIn, … kind billing, seq 31: of meter-1, "month", device_time 2026-11-01: energy_t1 812.4 kWh,
//   …
//
// Never in part: if some of its values are missing, a record counts as not read.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/base/quality.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"
#include "gateway/records/events/placed_time.h"

namespace baudgate::events {

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

}  // namespace baudgate::events
