// Events of a point, and their alarms: the key `events:` of a point. EventText describes an event
// of a device. AlarmSetting contains the priority and the delay of the alarms that the gateway
// raises itself.
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

/// `none`: the event is not an alarm. The word `yes` of the key `alarm` means medium.
enum class AlarmPriority : std::uint8_t { none, low, medium, high };
inline constexpr std::size_t kAlarmPriorities = 4;
template <>
inline constexpr std::array<Word<AlarmPriority>, 4> kWords<AlarmPriority> = {
    {{"high", AlarmPriority::high},
     {"medium", AlarmPriority::medium},
     {"low", AlarmPriority::low},
     {"off", AlarmPriority::none}}};
std::string_view Name(AlarmPriority priority);

/// The words of the key `alarm` at an event, for points and devices.
inline constexpr std::array<Word<AlarmPriority>, 5> kEventAlarmWords = {
    {{"no", AlarmPriority::none},
     {"yes", AlarmPriority::medium},
     {"low", AlarmPriority::low},
     {"medium", AlarmPriority::medium},
     {"high", AlarmPriority::high}}};

/// An event of a point: `{ on: above, value: 5, hysteresis: 0.2, delay: 3s, text: "…", alarm: high
/// }`.
struct PointEvent {
  enum class On : std::uint8_t { change, above, below };
  On on = On::change;
  Decimal value = 0;  ///< the limit of above and below, in units of the value
  /// In units of the value. The event ends at value - hysteresis for On::above, and at value +
  /// hysteresis for On::below. For On::change, smaller or equal changes are ignored.
  Decimal hysteresis = 0;
  Duration delay{};  ///< how long the condition, or its end, must last to count
  std::string text;  ///< empty: the event gets a text made from `on` and `value`
  AlarmPriority alarm = AlarmPriority::none;
  /// For On::change: the text of the point that ends the event; any other text begins it. Empty:
  /// each change of the point is a message without an end.
  std::string normal{};
  /// Name of the Record that is read and saved after the event; empty: no Record.
  std::string record{};
};

template <typename Visit>
void VisitFields(const PointEvent*, Visit visit) {
  visit(Field<&PointEvent::on>{.help = "condition that raises the event", .fallback = kRequired});
  visit(Field<&PointEvent::value>{.help = "limit for above and below",
                                  .fallback = "required with above and below"});
  visit(Field<&PointEvent::hysteresis>{
      .help = "on: above ends at value - hysteresis, on: below at value + hysteresis; on: change "
              "ignores a change up to this size"});
  visit(Field<&PointEvent::delay>{
      "delay", "time that the condition must last before the event begins or ends", 0ms, 24h});
  visit(Field<&PointEvent::text>{.help = "text of the event, in place of the default"});
  visit(Field<&PointEvent::alarm>{
      .help = "yes is medium", .fallback = "no", .words = kEventAlarmWords});
  visit(Field<&PointEvent::normal>{
      .help = "only with on: change; this value is normal, any other value is abnormal"});
  visit(Field<&PointEvent::record>{.help = "name of the record that is stored with the event"});
}

/// Returns "change" or "above 5", which distinguishes the events of one point.
std::string ConditionOf(const PointEvent& event);

/// An event begins a state (`on`), ends it (`off`), or does neither (`message`).
enum class EventState : std::uint8_t { off, on, message };
inline constexpr std::size_t kEventStates = 3;

inline constexpr std::uint32_t kLastEventCode = 999'999;

/// The description of an event of a device: a row of the table `events:` of a profile.
struct EventText {
  std::optional<std::uint32_t> channel;  ///< empty: the row applies to every channel
  std::uint32_t code = 0;
  EventState state = EventState::message;
  std::string text;
  AlarmPriority alarm = AlarmPriority::none;
  /// The code of the event that ends the alarm, on the same channel. Empty: the alarm has no end
  /// and only waits to be acknowledged.
  std::optional<std::uint32_t> until{};
  /// Name of the Record that is read and saved after the event; empty: no Record.
  std::string record{};
};

template <typename Visit>
void VisitFields(const EventText*, Visit visit) {
  visit(Field<&EventText::channel>{"channel", "only events of this channel", 0, 999,
                                   "every channel"});
  visit(Field<&EventText::code>{"code", "event code of the device", 1, kLastEventCode, kRequired});
  visit(Field<&EventText::state>{.help = "whether the event begins a state, ends one, or neither"});
  visit(Field<&EventText::text>{.help = "text of the event", .fallback = kRequired});
  visit(Field<&EventText::alarm>{
      .help = "yes is medium", .fallback = "no", .words = kEventAlarmWords});
  visit(Field<&EventText::until>{"until", "the code, with state: off, that ends the alarm", 1,
                                 kLastEventCode});
  visit(Field<&EventText::record>{.help = "name of the record that is stored with the event"});
}

/// Returns the row for this channel, or else the row for all channels; null if there is no row.
const EventText* FindEvent(std::span<const EventText> table, std::uint32_t channel,
                           std::uint32_t code);

/// Returns the row whose alarm this event ends; null if the event ends no alarm.
const EventText* FindEndedAlarm(std::span<const EventText> table, std::uint32_t channel,
                                std::uint32_t code);

// AlarmSetting contains settings for the alarms that the gateway raises itself: the key `alarms:`
// of the gateway, a line, a device and a route. A device without `priority` or `delay` takes this
// setting from its line, a line from the gateway.
struct AlarmSetting {
  AlarmPriority priority = AlarmPriority::medium;  ///< none: the key is `off`
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
