// An alarm as ISA 18.2 has it: somebody has to know of it, even when it is over. docs/events.md has
// the states for users.
//
//   normal ─raise→ active ─acknowledge→ acknowledged ─clear→ normal
//                  active ─clear→ returned ─acknowledge→ normal
//
// A device that says once more that it is on has lost its "off": it is active anew.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>

#include "config/model/point_event.h"
#include "gateway/base/time.h"

namespace baudgate::events {

/// The numbers are users'.
enum class AlarmState : std::uint8_t {
  normal = 0,        ///< it is kept no more
  active = 1,        ///< and nobody has acknowledged it
  acknowledged = 2,  ///< and active
  returned = 3,      ///< it is over, and nobody has acknowledged it
};
inline constexpr std::size_t kAlarmStates = 4;
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
  /// The first that is known since the start: it is an event only where the kept state differs.
  bool first = false;
  std::string by{};      ///< who acknowledges
  std::int64_t seq = 0;  ///< acknowledges only what this event has raised; 0: whatever it was
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
  std::string by;        ///< who has acknowledged it last

  AlarmKey key() const { return {line, device, name}; }
};

/// "bay-1.feeder-1.current_l1", "bay-1", or "gateway" where it is of no line: what users call it.
std::string PlaceOf(const Alarm& alarm);

struct EventRecord;

struct AlarmChange {
  bool counts = true;            ///< false: the event has not happened
  std::optional<Alarm> alarm{};  ///< as it is now; nothing: as before
};
/// `before`: null where it is normal. `event` has its number.
AlarmChange Apply(const Alarm* before, const EventRecord& event);

}  // namespace baudgate::events
