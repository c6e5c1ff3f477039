// An alarm as in ISA 18.2: a person has to know of it, even when it is over. docs/events.md has the
// states for users.
//
//   normal ─raise→ active ─acknowledge→ acknowledged ─clear→ normal
//                  active ─clear→ returned ─acknowledge→ normal
//
// If a device reports "on" twice, its "off" was lost: the alarm is raised again.
//
// AlarmBoard shows outputs the alarms that are on the disk.
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

/// The numbers are users'.
enum class AlarmState : std::uint8_t {
  normal = 0,        ///< no longer kept
  active = 1,        ///< and not acknowledged
  acknowledged = 2,  ///< and active
  returned = 3,      ///< over, and not acknowledged
};
std::string_view Name(AlarmState state);  ///< "returned"
constexpr bool IsActive(AlarmState state) {
  return state == AlarmState::active || state == AlarmState::acknowledged;
}
constexpr bool IsUnacknowledged(AlarmState state) {
  return state == AlarmState::active || state == AlarmState::returned;
}

/// What an event does to its alarm, which is named by line, device and the event's subject.
struct AlarmMark {
  enum class Step : std::uint8_t {
    none,
    raise,
    clear,
    pulse,  ///< raised and over at once
    acknowledge,
    priority,  ///< it is another one from now on
  };
  Step step = Step::none;
  config::AlarmPriority priority = config::AlarmPriority::none;
  std::string point{};
  /// The first state known since the start: it is an event only if the kept state differs.
  bool first = false;
  std::string by{};      ///< who acknowledges
  std::int64_t seq = 0;  ///< acknowledges only the alarm that this event has raised; 0: any
};

using AlarmKey = std::tuple<std::string, std::string, std::string>;

struct Alarm {
  std::string line;
  std::string device;
  std::string name;   ///< "current_l1 above 5"; of an event of the device "channel:code"
  std::string point;  ///< empty: of the device
  AlarmState state = AlarmState::normal;
  config::AlarmPriority priority = config::AlarmPriority::medium;
  std::int64_t seq = 0;  ///< the event that has raised it
  WallTime raised{};     ///< device_time of that event
  WallTime changed{};    ///< the state, by the gateway's clock
  std::string text;      ///< of that event
  std::string by;        ///< who acknowledged it last

  AlarmKey key() const { return {line, device, name}; }
};

/// Its name for users: "bay-1.feeder-1.current_l1", "bay-1", or "gateway" if it is of no line.
std::string PlaceOf(const Alarm& alarm);

struct EventRecord;

struct AlarmChange {
  bool counts = true;            ///< false: the event is dropped
  std::optional<Alarm> alarm{};  ///< the new state; empty: as before
};
/// `before`: null if it is normal. `event` has its number.
AlarmChange Apply(const Alarm* before, const EventRecord& event);

// The alarms as they are on the disk, for outputs, which never wait for the disk. Each change has a
// version, so an output that has come to one gets the newer ones. From any thread.
//
//   Update(a active), Update(b active), Update(a acknowledged)
//   Take(0)   → b active, a acknowledged
//   Take(2)   → a acknowledged
//
class AlarmBoard {
 public:
  /// The most alarms that are known; beyond it the oldest normal ones are forgotten.
  static constexpr std::size_t kMost = 10'000;

  void Update(const Alarm& alarm);

  struct Change {
    std::uint64_t version = 0;
    Alarm alarm{};  ///< as it is now; may be normal
  };
  /// Alarms that have changed after version `after`, in order of their versions.
  std::vector<Change> Take(std::uint64_t after, std::size_t most) const;

 private:
  void Forget() BAUDGATE_REQUIRES(mutex_);

  mutable Mutex mutex_;
  std::uint64_t version_ BAUDGATE_GUARDED_BY(mutex_) = 0;
  std::map<AlarmKey, Change> alarms_ BAUDGATE_GUARDED_BY(mutex_);
  std::map<std::uint64_t, AlarmKey> by_version_ BAUDGATE_GUARDED_BY(mutex_);
};

}  // namespace baudgate::events
