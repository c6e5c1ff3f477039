// What an event of a device means: the table `events:` of a profile.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "config/model/fields.h"
#include "config/model/point_event.h"

namespace baudgate::config {

/// As Modbus and the command line say it.
enum class EventState : std::uint8_t { off, on, message };
inline constexpr std::size_t kEventStates = 3;

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
  visit(Field<&EventText::channel>());
  visit(Field<&EventText::code>());
  visit(Field<&EventText::state>());
  visit(Field<&EventText::text>());
  visit(Field<&EventText::alarm>());
  visit(Field<&EventText::until>());
  visit(Field<&EventText::record>());
}

/// That of the channel before that of all; null: the table does not have it.
const EventText* FindEvent(std::span<const EventText> table, std::uint32_t channel,
                           std::uint32_t code);

/// The alarm that this event ends; null: none.
const EventText* FindEndedAlarm(std::span<const EventText> table, std::uint32_t channel,
                                std::uint32_t code);

std::string_view Name(EventState state);  ///< "on"

}  // namespace baudgate::config
