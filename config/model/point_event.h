// What happens at a point and is kept, and what of it is an alarm: the key `events:` of a point.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "config/model/fields.h"
#include "gateway/base/decimal.h"
#include "gateway/base/time.h"

namespace baudgate::config {

/// none: it is no alarm. `alarm: yes` is medium.
enum class AlarmPriority : std::uint8_t { none, low, medium, high };
inline constexpr std::size_t kAlarmPriorities = 4;
std::string_view Name(AlarmPriority priority);  ///< "high"; "" for none

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
  visit(Field<&PointEvent::on>());
  visit(Field<&PointEvent::value>());
  visit(Field<&PointEvent::hysteresis>());
  visit(Field<&PointEvent::delay>());
  visit(Field<&PointEvent::text>());
  visit(Field<&PointEvent::alarm>());
  visit(Field<&PointEvent::normal>());
  visit(Field<&PointEvent::record>());
}
std::string_view Name(PointEvent::On on);  ///< "above"

/// "change", "above 5": what tells one of a point from another.
std::string ConditionOf(const PointEvent& event);

}  // namespace baudgate::config
