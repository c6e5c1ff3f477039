// Acknowledgements that wait for the disk: the client is told when they are saved, or why they are
// not. gateway/records/events/pending_events.h keeps them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "gateway/records/events/event_book.h"
#include "gateway/records/events/event_source.h"

namespace baudgate::events {

struct WaitingAck {
  std::size_t alarms = 0;
  WallTime at{};
  std::function<void(const Acknowledged&)> done;
};

/// Adds an event to the book for each unacknowledged alarm that the query means. Returns their
/// number.
std::size_t TellAcks(const AckQuery& query, const std::vector<Alarm>& alarms, EventBook& book,
                     WallTime at);
/// To be called without a lock. `trouble`: why they are not on the disk; empty: they are.
void AnswerAcks(const std::vector<WaitingAck>& acks, const std::string& trouble);

}  // namespace baudgate::events
