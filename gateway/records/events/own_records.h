// This file contains the gateway's own events, with the codes and texts that users read
// (docs/events.md). No lock, no clock, no disk.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "config/model/config.h"
#include "gateway/records/events/event_record.h"
#include "gateway/records/events/event_source.h"
#include "gateway/records/events/own_alarms.h"

namespace baudgate::events {

// OwnCode contains the codes of the gateway's own events. The numbers are public (docs/events.md):
// new numbers are appended, and no number is used again. Events of devices cannot have these codes:
// the event table of a profile ends at 999999.
enum class OwnCode : std::uint32_t {
  started = 1'000'001,
  stops = 1'000'002,
  left_out = 1'000'003,  ///< too many events of one kind came, and some were left out; see Shares
  /// The file events.db could not be written; reported when it can be written again.
  disk_trouble = 1'000'004,
  port_down = 1'000'005,
  port_lent = 1'000'006,
  collisions = 1'000'007,
  ring_open = 1'000'008,
  no_answer = 1'000'009,
  not_in_use = 1'000'010,
  wrong_device = 1'000'011,
  replaced = 1'000'012,
  point_change = 1'000'013,  ///< a value has changed; `text` names the point
  point_above = 1'000'014,
  point_below = 1'000'015,
  acknowledged = 1'000'016,
  not_watched = 1'000'017,
  reloaded = 1'000'018,
  taken_back = 1'000'019,  ///< a configuration that was not confirmed was rolled back
  clock_corrected = 1'000'020,
  clock_left = 1'000'021,   ///< the gateway could not correct the clock of a device
  own_alarm = 1'000'022,    ///< an alarm of a line, a device, a route or a disk (see Trouble)
  port_served = 1'000'023,  ///< a network client uses the port of a line that is not polled
  priority = 1'000'024,     ///< the configuration has changed the priority of an active alarm
};

constexpr std::uint32_t CodeOf(OwnCode code) { return static_cast<std::uint32_t>(code); }

struct LastRun {
  enum class End : std::uint8_t { unknown, in_order, broken_off } end = End::unknown;
  WallTime last{};
};

EventRecord StartRecord(const std::string& version, const LastRun& before, WallTime at);
EventRecord EndRecord(WallTime at);
/// Returns the event for a disk trouble that is over. `trouble` can begin with the name of the
/// file.
EventRecord DiskTroubleRecord(const std::string& file, std::string_view trouble, WallTime since,
                              WallTime at);
/// Returns the event for `events` left-out events like `last`, the first of them at `since`. The
/// event has the line and device of `last`, and no alarm.
EventRecord LeftOutRecord(std::uint64_t events, const EventRecord& last, WallTime since,
                          WallTime at);
EventRecord NotWatchedRecord(const Alarm& alarm, WallTime at);
EventRecord PriorityRecord(const Alarm& alarm, config::AlarmPriority priority, WallTime at);
EventRecord OwnAlarmRecord(Trouble trouble, const std::string& line, const std::string& device,
                           AlarmMark mark, std::string text, WallTime at);
EventRecord AckRecord(const Alarm& alarm, const AckQuery& query, WallTime at);

struct Fact {
  /// One of the codes port_down to replaced, port_served, clock_corrected and clock_left.
  OwnCode code = OwnCode::no_answer;
  bool over = false;
  std::string line{};
  std::string device{};  ///< empty: the fact is about the line
  std::string why{};
  /// With `over`: after a reload no line reports the fact, so perhaps the fact is not over.
  bool unknown = false;
};
EventRecord FactRecord(const Fact& fact, WallTime at);

// `OwnRun` makes one event for the start and one for the end of the gateway. The text of the start
// event contains how the previous run ended. No clock, no lock:
// gateway/records/events/event_queue.h provides these.
class OwnRun {
 public:
  void OnStarted(std::string version, WallTime at) {
    start_ = {std::move(version), at};
    ends_ = true;
  }
  void OnOpened(const LastRun& before) { before_ = before; }

  bool waits() const { return start_.has_value(); }
  /// Returns the start event; a second call returns nothing. Call OnOpened first.
  std::optional<EventRecord> TakeStart() {
    const auto start = std::exchange(start_, std::nullopt);
    if (!start) return std::nullopt;
    return StartRecord(start->version, before_, start->at);
  }
  std::optional<EventRecord> TakeEnd(WallTime at) {
    if (!std::exchange(ends_, false)) return std::nullopt;
    return EndRecord(at);
  }

 private:
  struct Start {
    std::string version;
    WallTime at{};
  };
  std::optional<Start> start_;  // empty: there is no start event, or TakeStart has returned it
  bool ends_ = false;
  LastRun before_{};
};

// `LastingFacts` contains the facts about lines and devices that have begun and have not ended, by
// name. A reload that restarts a line gives new numbers to its devices; by the names, the end of a
// fact still belongs to its beginning.
//
//   port_down of bay-1 … bay-1 is restarted … over   the end is an event, although the new line
//                                                    has not reported the beginning
//   ring_open of bay-1 … bay-1 is restarted          ends at the restart: the new line reports no
//                                                    end, only a new beginning
//   not_in_use of feeder-1 … a reload enables it     ends at the reload
class LastingFacts {
 public:
  /// Devices that the configuration disables are out of use from the start.
  explicit LastingFacts(const config::Config& config);

  /// Records the fact. Returns true if an event is to be made: at a beginning that was not recorded
  /// yet, at the end of a recorded beginning, and for each fact without an end. `first`: the line
  /// reports an end without having reported the beginning.
  bool IsNews(const Fact& fact, bool first);
  /// Applies a reload and returns the facts that end with it. `begun`: lines that are new or
  /// restarted.
  std::vector<Fact> Renew(const config::Config& config, const std::set<std::string>& begun);

 private:
  using DeviceKey = std::pair<std::string, std::string>;  // line, device
  using Key = std::tuple<OwnCode, std::string, std::string>;

  std::vector<DeviceKey> NoteUse(const config::Config& config);

  std::set<Key> lasting_;
  std::map<DeviceKey, bool> enabled_;
};

}  // namespace baudgate::events
