// The gateway's own events, in the codes and words that users read (docs/events.md). No lock, no
// clock, no disk. OwnCode has the codes, OwnRun the start and the end of the gateway, and
// LastingFacts what has begun and is not over.
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

// The codes of the gateway's own events. The numbers are public (docs/events.md): new ones are
// appended, none is used again. Devices do not have such codes: a table of a profile ends at
// 999999.
enum class OwnCode : std::uint32_t {
  started = 1'000'001,
  stops = 1'000'002,
  left_out = 1'000'003,      ///< events of one kind that came too often
  disk_trouble = 1'000'004,  ///< of events.db, reported when it is over
  port_down = 1'000'005,     ///< of a line
  port_lent = 1'000'006,
  collisions = 1'000'007,
  ring_open = 1'000'008,
  no_answer = 1'000'009,  ///< of a device
  not_in_use = 1'000'010,
  wrong_device = 1'000'011,
  replaced = 1'000'012,
  point_change = 1'000'013,  ///< of a point, in `text`
  point_above = 1'000'014,
  point_below = 1'000'015,
  acknowledged = 1'000'016,  ///< an alarm
  not_watched = 1'000'017,   ///< an alarm that the configuration no longer has
  reloaded = 1'000'018,
  taken_back = 1'000'019,       ///< a configuration that was not confirmed
  clock_corrected = 1'000'020,  ///< of a device
  clock_left = 1'000'021,       ///< of a device: it should have been corrected, and was not
  own_alarm = 1'000'022,        ///< of a line, a device, a route or a disk
  port_served = 1'000'023,      ///< of a line that is not polled: a client has its port
  priority = 1'000'024,         ///< of an active alarm: the configuration has changed it
};

constexpr std::uint32_t CodeOf(OwnCode code) { return static_cast<std::uint32_t>(code); }

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

// The start and the end of the gateway itself as events, once each; the start says how the previous
// run ended. No clock, and no lock: gateway/records/events/event_queue.h has it.
class OwnRun {
 public:
  void OnStarted(std::string version, WallTime at) {
    start_ = {std::move(version), at};
    ends_ = true;
  }
  /// The previous run, from the file.
  void OnOpened(const LastRun& before) { before_ = before; }

  bool waits() const { return start_.has_value(); }
  /// When opened.
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
  std::optional<Start> start_;  // to be told
  bool ends_ = false;           // to be told
  LastRun before_{};
};

// Which lasting facts about lines and devices have begun and are not over, by name: a reload that
// restarts a line gives it new numbers, but the end of a fact belongs to its beginning.
//
//   port_down of bay-1 … bay-1 is restarted … over      the end is news, though the new line has
//                                                       not told the beginning
//   ring_open of bay-1 … bay-1 is restarted             ends: the new line tells only its beginning
//   not_in_use of a … a is taken into use by a reload   ends
//
class LastingFacts {
 public:
  /// A device that the configuration does not use is out of use from the start.
  explicit LastingFacts(const config::Config& config);

  /// Takes note of it. False: it is not worth an event. `first`: its line has not told the
  /// beginning of what is over.
  bool IsNews(const Fact& fact, bool first);
  /// A reload; `begun`: lines that are new or restarted. Returns what has ended by it.
  std::vector<Fact> Renew(const config::Config& config, const std::set<std::string>& begun);

 private:
  using DeviceKey = std::pair<std::string, std::string>;  // line, device
  using Key = std::tuple<OwnCode, std::string, std::string>;

  std::vector<DeviceKey> NoteUse(const config::Config& config);

  std::set<Key> lasting_;
  std::map<DeviceKey, bool> enabled_;  // devices of the configuration
};

}  // namespace baudgate::events
