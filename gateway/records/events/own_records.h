// The gateway's own events, in the codes and words that users read (docs/events.md). No lock, no
// clock, no disk.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "gateway/records/events/event_record.h"
#include "gateway/records/events/event_source.h"
#include "gateway/records/events/own_codes.h"
#include "gateway/records/events/trouble.h"

namespace baudgate::events {

/// How the previous run of the gateway ended.
struct LastRun {
  enum class End : std::uint8_t { unknown, in_order, broken_off } end = End::unknown;
  WallTime last{};  ///< time of its last event
};

EventRecord StartRecord(const std::string& version, const LastRun& before, WallTime at);
EventRecord EndRecord(WallTime at);
/// The trouble is over. `trouble` may begin with the name of the file.
EventRecord DiskTroubleRecord(const std::string& file, std::string_view trouble, WallTime since,
                              WallTime at);
/// This many events like `last`, from `since` on: of its line and device, and of no alarm.
EventRecord LeftOutRecord(std::uint64_t events, const EventRecord& last, WallTime since,
                          WallTime at);
/// Ends an alarm that the configuration no longer has.
EventRecord NotWatchedRecord(const Alarm& alarm, WallTime at);
/// Says that the priority of an alarm has changed in the configuration.
EventRecord PriorityRecord(const Alarm& alarm, config::AlarmPriority priority, WallTime at);
/// The event that raises or ends one of the gateway's own alarms.
EventRecord OwnAlarmRecord(Trouble trouble, const std::string& line, const std::string& device,
                           AlarmMark mark, std::string text, WallTime at);
EventRecord AckRecord(const Alarm& alarm, const AckQuery& query, WallTime at);

/// A fact about a line or one of its devices.
struct Fact {
  OwnCode code = OwnCode::no_answer;  ///< port_down … replaced, or of a clock
  bool over = false;
  std::string line{};
  std::string device{};  ///< empty: of the line
  std::string why{};
  bool unknown = false;  ///< with `over`: nobody watches it any more, so it may not be over
};
EventRecord FactRecord(const Fact& fact, WallTime at);
/// Whether a Fact with this code lasts. The others happen at one moment.
bool HasEnd(OwnCode code);

}  // namespace baudgate::events
