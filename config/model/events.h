// Events of a point, and which of them are alarms: the key `events:` of a point.
// EventText says what an event of a device means. AlarmSetting gives the priority and the delay of
// the alarms that the gateway raises itself.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "config/model/fields.h"
#include "gateway/base/decimal.h"
#include "gateway/base/time.h"

namespace baudgate::config {

/// none: it is no alarm. `alarm: yes` is medium.
enum class AlarmPriority : std::uint8_t { none, low, medium, high };
inline constexpr std::size_t kAlarmPriorities = 4;
template <>
inline constexpr std::array<Word<AlarmPriority>, 4> kWords<AlarmPriority> = {
    {{"high", AlarmPriority::high},
     {"medium", AlarmPriority::medium},
     {"low", AlarmPriority::low},
     {"off", AlarmPriority::none}}};
std::string_view Name(AlarmPriority priority);  ///< "high"; "" for none

/// The words that `alarm` of an event may have, for points and devices.
inline constexpr std::array<Word<AlarmPriority>, 5> kEventAlarmWords = {
    {{"no", AlarmPriority::none},
     {"yes", AlarmPriority::medium},
     {"low", AlarmPriority::low},
     {"medium", AlarmPriority::medium},
     {"high", AlarmPriority::high}}};

/// `{ on: above, value: 5, hysteresis: 0.2, delay: 3s, text: "…", alarm: high }`.
struct PointEvent {
  enum class On : std::uint8_t { change, above, below };
  On on = On::change;
  Decimal value = 0;  ///< of above and below, in units of the point's value
  /// In units of the value: above ends at value - hysteresis, below at value + hysteresis; of
  /// change: so much and less is none.
  Decimal hysteresis = 0;
  Duration delay{};  ///< for so long it has to be so, or not so any more
  std::string text;  ///< empty: what `on` says
  AlarmPriority alarm = AlarmPriority::none;
  /// For `change`: this text means that all is well, any other that something is wrong. Empty: each
  /// change is a message.
  std::string normal{};
  std::string record{};  ///< which values are read after it and kept with it; empty: none
};

template <typename Visit>
void VisitFields(const PointEvent*, Visit visit) {
  visit(Field<&PointEvent::on>{.help = "what raises it", .fallback = kRequired});
  visit(Field<&PointEvent::value>{.help = "the limit of above and below",
                                  .fallback = "required with above and below"});
  visit(Field<&PointEvent::hysteresis>{
      .help = "above ends at value - hysteresis, below at value + hysteresis; of change: so much "
              "and less is none"});
  visit(Field<&PointEvent::delay>{"delay", "for so long it has to be so, or not so any more", 0ms,
                                  24h});
  visit(Field<&PointEvent::text>{.help = "in place of what on says"});
  visit(Field<&PointEvent::alarm>{
      .help = "yes is medium", .fallback = "no", .words = kEventAlarmWords});
  visit(Field<&PointEvent::normal>{
      .help = "of change: this value means that all is well, any other that something is wrong"});
  visit(Field<&PointEvent::record>{.help = "which values are kept with it: a name of records"});
}

/// "change", "above 5": what tells one of a point from another.
std::string ConditionOf(const PointEvent& event);

// The meaning of an event of a device: the table `events:` of a profile.

/// As Modbus and the command line say it.
enum class EventState : std::uint8_t { off, on, message };
inline constexpr std::size_t kEventStates = 3;

inline constexpr std::uint32_t kLastEventCode = 999'999;

struct EventText {
  std::optional<std::uint32_t> channel;  ///< empty: of every channel
  std::uint32_t code = 0;
  EventState state = EventState::message;
  std::string text;
  AlarmPriority alarm = AlarmPriority::none;
  /// The code that ends the alarm, of the same channel; empty: it has no end of its own, and only
  /// waits to be acknowledged.
  std::optional<std::uint32_t> until{};
  std::string record{};  ///< which values are read after it and kept with it; empty: none
};

template <typename Visit>
void VisitFields(const EventText*, Visit visit) {
  visit(Field<&EventText::channel>{"channel", "of this channel alone", 0, 999, "every channel"});
  visit(Field<&EventText::code>{"code", "the device's own number", 1, kLastEventCode, kRequired});
  visit(Field<&EventText::state>{.help = "what begins, what ends, or neither"});
  visit(Field<&EventText::text>{.help = "what it means", .fallback = kRequired});
  visit(Field<&EventText::alarm>{
      .help = "yes is medium", .fallback = "no", .words = kEventAlarmWords});
  visit(Field<&EventText::until>{"until", "the code, with state: off, that ends the alarm", 1,
                                 kLastEventCode});
  visit(Field<&EventText::record>{.help = "which values are kept with it: a name of records"});
}

/// That of the channel before that of all; null: the table does not have it.
const EventText* FindEvent(std::span<const EventText> table, std::uint32_t channel,
                           std::uint32_t code);

/// The alarm that this event ends; null: none.
const EventText* FindEndedAlarm(std::span<const EventText> table, std::uint32_t channel,
                                std::uint32_t code);

// The alarms that the gateway raises itself: the key `alarms:` of the gateway, a line, a device and
// a route. The more specific setting wins, each key by itself.
struct AlarmSetting {
  AlarmPriority priority = AlarmPriority::medium;  ///< none: `off`
  Duration delay = std::chrono::seconds(30);

  bool on() const { return priority != AlarmPriority::none; }
  bool operator==(const AlarmSetting&) const = default;
};

template <typename Visit>
void VisitFields(const AlarmSetting*, Visit visit) {
  visit(Field<&AlarmSetting::priority>{
      .help = "priority of the alarms that the gateway raises itself"});
  visit(Field<&AlarmSetting::delay>{
      "delay", "an alarm is raised once its cause has lasted this long", 0ms, 24h});
}

}  // namespace baudgate::config
