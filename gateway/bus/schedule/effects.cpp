// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/schedule/effects.h"

#include <utility>

namespace baudgate {

std::optional<ReportedEvents> EventDelivery::Take(const Device& device, EventBatch batch,
                                                  const Exchange& exchange) {
  State& state = states_[device];
  if (batch.drained) state.drained_at = exchange.asked;
  if (batch.events.empty() && batch.past.empty()) return std::nullopt;
  state.background = exchange.background;
  ReportedEvents events{device.index, std::move(batch), exchange.answered, {}};
  if (state.drained_at) events.oldest = exchange.answered.instant - *state.drained_at;
  return events;
}

Schedule::Brought EventDelivery::OnKept(const Device& device, const std::string& said) {
  State& state = states_[device];
  const bool repeats = state.said == said;
  state.said = said;
  if (std::exchange(state.background, false)) return Schedule::Brought::something_else;
  return repeats ? Schedule::Brought::no_news : Schedule::Brought::news;
}

}  // namespace baudgate
