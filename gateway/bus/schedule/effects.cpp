// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/schedule/effects.h"

#include <utility>

namespace baudgate::bus {

std::optional<ReportedEvents> EventDelivery::Take(const Device& device, protocols::EventBatch batch,
                                                  const Exchange& exchange) {
  Entry& entry = entries_[device];
  if (batch.drained) entry.drained_at = exchange.asked;
  if (batch.events.empty() && batch.past.empty()) return std::nullopt;
  entry.background = exchange.background;
  ReportedEvents events{device.index, std::move(batch), exchange.answered, {}};
  if (entry.drained_at) events.oldest = exchange.answered.instant - *entry.drained_at;
  return events;
}

Schedule::Brought EventDelivery::OnKept(const Device& device, const std::string& said) {
  Entry& entry = entries_[device];
  const bool repeats = entry.said == said;
  entry.said = said;
  if (std::exchange(entry.background, false)) return Schedule::Brought::something_else;
  return repeats ? Schedule::Brought::no_news : Schedule::Brought::news;
}

}  // namespace baudgate::bus
