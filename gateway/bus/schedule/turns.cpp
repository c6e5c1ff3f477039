// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/schedule/turns.h"

#include <algorithm>

namespace baudgate::bus {

std::vector<Turns::Choice> Turns::Order(const Waiting& waiting) const {
  std::vector<Choice> order;
  const bool urgent_first = UrgentAllowed(waiting.short_write);
  if (urgent_first) order.push_back(Choice::urgent);
  order.insert(order.end(), {Choice::parked, Choice::probe});
  if (waiting.routed) {
    // After one request of each client of high priority one of the rest.
    if (high_in_row_ < waiting.high_clients) order.push_back(Choice::routed_high);
    if (poll_next_) order.push_back(Choice::poll);
    order.insert(order.end(),
                 {Choice::routed_normal, Choice::poll, Choice::routed_high, Choice::routed_low});
  } else {
    order.push_back(Choice::poll);
  }
  if (!urgent_first) order.push_back(Choice::urgent);
  return order;
}

void Turns::OnTaken(Choice choice, const Waiting& waiting) {
  switch (choice) {
    case Choice::urgent:
      if (UrgentAllowed(waiting.short_write)) ++urgent_in_row_;
      return;
    case Choice::parked:
    case Choice::probe:
      return;
    case Choice::routed_high:
      high_in_row_ = high_in_row_ < waiting.high_clients ? high_in_row_ + 1 : 0;
      return;
    case Choice::poll:
    case Choice::routed_normal:
      poll_next_ = choice == Choice::routed_normal;
      high_in_row_ = 0;
      return;
    case Choice::routed_low:
      high_in_row_ = 0;
      return;
  }
}

void Turns::OnNothing() {
  urgent_in_row_ = 0;
  high_in_row_ = 0;
}

void Turns::OnTime(Duration passed, bool failing) {
  debt_ = std::clamp(debt_ + (failing ? passed : -passed), Duration::zero(), kMostDebt);
}

}  // namespace baudgate::bus
