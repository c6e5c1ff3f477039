// `Alarm` is an alarm as in ISA 18.2: a person has to acknowledge it, even if its cause is over.
// docs/events.md describes the states for users.
//
//   normal ─raise→ active ─acknowledge→ acknowledged ─clear→ normal
//                  active ─clear→ returned ─acknowledge→ normal
//
// If a device reports "on" twice, its "off" was lost, so the alarm is raised again.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "config/model/events.h"
#include "gateway/base/guarded.h"
#include "gateway/base/time.h"

namespace baudgate::events {

/// The states of an alarm. The numbers are public: they are in the samples on DDS.
enum class AlarmState : std::uint8_t {
  normal = 0,  ///< no alarm: the alarm is deleted from the file
  active = 1,
  acknowledged = 2,
  returned = 3,  ///< no longer active, not acknowledged yet
};
std::string_view Name(AlarmState state);
constexpr bool IsActive(AlarmState state) {
  return state == AlarmState::active || state == AlarmState::acknowledged;
}
constexpr bool IsUnacknowledged(AlarmState state) {
  return state == AlarmState::active || state == AlarmState::returned;
}

/// The effect of an event on its alarm. The alarm's key is line, device and EventRecord::subject.
struct AlarmMark {
  enum class Step : std::uint8_t {
    none,
    raise,
    clear,
    pulse,  ///< raises and clears the alarm at once, for an event without an end
    acknowledge,
    priority,
  };
  Step step = Step::none;
  config::AlarmPriority priority = config::AlarmPriority::none;
  std::string point{};
  /// True: the event reports the first state that is known since the start. It is dropped if the
  /// stored alarm is already in this state, for example active at `raise`.
  bool first = false;
  std::string by{};
  /// Acknowledges only the alarm that the event of this number has raised; 0: any alarm.
  std::int64_t seq = 0;
};

using AlarmKey = std::tuple<std::string, std::string, std::string>;

struct Alarm {
  std::string line;
  std::string device;
  std::string name;  ///< "current_l1 above 5"; after an event that a device reports, "channel:code"
  std::string point;  ///< empty: the alarm concerns the whole device
  AlarmState state = AlarmState::normal;
  config::AlarmPriority priority = config::AlarmPriority::medium;
  std::int64_t seq = 0;
  WallTime raised{};   ///< device_time of the raising event
  WallTime changed{};  ///< last change of the state, by the gateway's clock
  std::string text;
  std::string by;

  AlarmKey key() const { return {line, device, name}; }
};

/// True if people should see `a` before `b`, as in ISA 18.2: unacknowledged before acknowledged,
/// active before returned, then by priority, then the newest.
inline bool IsWorse(const Alarm& a, const Alarm& b) {
  const auto rank = [](const Alarm& one) {
    return std::tuple(IsUnacknowledged(one.state), IsActive(one.state), one.priority, one.seq);
  };
  return rank(a) > rank(b);
}

/// Returns "bay-1.feeder-1.current_l1", "bay-1", or "gateway" if the alarm has no line.
std::string PlaceOf(const Alarm& alarm);

struct EventRecord;

struct AlarmChange {
  bool counts = true;            ///< false: the event must be dropped
  std::optional<Alarm> alarm{};  ///< the alarm after the change; empty: the alarm has not changed
};
/// Returns the effect of an event on its alarm. `before`: the alarm before the event; null: its
/// state was normal. `event.seq` must be set.
AlarmChange Apply(const Alarm* before, const EventRecord& event);

// `AlarmBoard` contains the alarms as they are on the disk, so outputs need not wait for the disk.
// Each change gets a version number; an output passes the last version that it has read.
// Thread-safe.
//
//   Update(a active), Update(b active), Update(a acknowledged)
//   Take(0)   → b active, a acknowledged
//   Take(2)   → a acknowledged
class AlarmBoard {
 public:
  /// The limit of the number of alarms. Above it, the oldest normal alarm is removed.
  static constexpr std::size_t kMost = 10'000;

  void Update(const Alarm& alarm);

  struct Change {
    std::uint64_t version = 0;
    Alarm alarm{};  ///< state of the alarm; can be normal
  };
  std::vector<Change> Take(std::uint64_t after, std::size_t most) const;

 private:
  void Forget() BAUDGATE_REQUIRES(mutex_);

  mutable Mutex mutex_;
  std::uint64_t version_ BAUDGATE_GUARDED_BY(mutex_) = 0;
  std::map<AlarmKey, Change> alarms_ BAUDGATE_GUARDED_BY(mutex_);
  std::map<std::uint64_t, AlarmKey> by_version_ BAUDGATE_GUARDED_BY(mutex_);
};

}  // namespace baudgate::events
