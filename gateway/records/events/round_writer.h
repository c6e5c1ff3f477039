// Writes the rounds of the events: the file is opened, what is due is written, and then all others
// are told: outputs by the feed, lines, alarms, clients that wait. On the writing thread, unless it
// says otherwise.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "gateway/records/events/event_file.h"
#include "gateway/records/events/event_queue.h"
#include "gateway/records/events/event_rounds.h"
#include "gateway/records/events/event_source.h"
#include "gateway/records/events/log_options.h"

namespace baudgate::events {

class RoundWriter {
 public:
  /// All outlive it. `options` has a writer.
  RoundWriter(const LogOptions& options, const EventQueue& queue, EventRounds& rounds);

  /// All that is due; `last`: until nothing is. Returns when the next round is due.
  Instant Run(bool last);
  /// Before the first round: what outputs ask for makes a round due.
  void Serve();
  /// Before the last round, on any other thread: outputs can ask for nothing more.
  void StopServing();
  /// From any thread: alarms that have changed in these batches, unless that was reported before.
  void TellAlarms(const std::vector<Batch>& batches) const;
  /// From any thread. `oldest`: number of the first event in the file.
  std::vector<Consumer> Consumers(std::int64_t oldest) const;

 private:
  void WriteDue();
  Status Open();
  Status Write(EventRounds::Round& round);
  void Feed(const std::vector<Batch>& batches);
  void TellOwed(const std::vector<Batch>& batches) const;
  void ReadBacklog();

  const LogOptions& options_;
  const EventQueue& queue_;
  EventRounds& rounds_;
  EventFile file_;
  EventFeed* const feed_;      ///< null: there is none
  CursorBook* const cursors_;  ///< null: there are none
};

}  // namespace baudgate::events
