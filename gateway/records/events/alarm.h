// An alarm as in ISA 18.2: a person has to know of it, even when it is over. docs/events.md has the
// states for users.
//
//   normal ─raise→ active ─acknowledge→ acknowledged ─clear→ normal
//                  active ─clear→ returned ─acknowledge→ normal
//
// If a device reports "on" twice, its "off" was lost: the alarm is raised again.
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
  normal = 0,        ///< no longer kept
  active = 1,        ///< and not acknowledged
  acknowledged = 2,  ///< and active
  returned = 3,      ///< over, and not acknowledged
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

}  // namespace baudgate::events
