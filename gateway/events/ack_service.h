// Acknowledgements that wait for the disk: the client is told when they are saved, or why they are
// not. No lock: gateway/events/pending_events.h has it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "gateway/events/event_book.h"
#include "gateway/events/event_source.h"

namespace baudgate::events {

class AckService {
 public:
  using Done = std::function<void(const Acknowledged&)>;

  /// Adds an event to the book for each unacknowledged alarm that the query means. Returns their
  /// number.
  static std::size_t Tell(const AckQuery& query, const std::vector<Alarm>& alarms, EventBook& book,
                          WallTime at);

  struct Ack {
    std::size_t alarms = 0;
    WallTime at{};
    Done done;
  };
  void Wait(Ack ack) { acks_.push_back(std::move(ack)); }
  /// Takes all that wait now.
  std::vector<Ack> Take() { return std::exchange(acks_, {}); }
  /// To be called without the lock. `trouble`: why they are not on the disk; empty: they are.
  static void Answer(const std::vector<Ack>& acks, const std::string& trouble);

 private:
  std::vector<Ack> acks_;
};

}  // namespace baudgate::events
