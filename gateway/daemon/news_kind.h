// How news of lines and devices is recorded: the one table from what a line tells to the code of
// the event and the trouble of the alarm. The words of an event are in
// gateway/records/events/own_records.cpp, the name of an alarm in
// gateway/records/events/trouble.cpp.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "gateway/bus/devices/poller_listener.h"
#include "gateway/records/events/own_codes.h"
#include "gateway/records/events/trouble.h"

namespace baudgate {

struct NewsKind {
  events::OwnCode code;
  std::optional<events::Trouble> trouble{};  ///< empty: it is no alarm
};

/// The compiler refuses news without a row.
constexpr NewsKind KindOf(News::What what) {
  using events::OwnCode;
  using events::Trouble;
  switch (what) {
    case News::What::no_answer:
      break;
    case News::What::not_in_use:
      return {OwnCode::not_in_use};
    case News::What::wrong_device:
      return {OwnCode::wrong_device, Trouble::wrong_device};
    case News::What::replaced:
      return {OwnCode::replaced, Trouble::replaced};
    case News::What::port_down:
      return {OwnCode::port_down, Trouble::port_down};
    case News::What::port_lent:
      return {OwnCode::port_lent};
    case News::What::collisions:
      return {OwnCode::collisions};
    case News::What::ring_open:
      return {OwnCode::ring_open, Trouble::ring_open};
    case News::What::port_served:
      return {OwnCode::port_served};
  }
  return {OwnCode::no_answer, Trouble::no_answer};
}

}  // namespace baudgate
