// The events while the gateway runs: lines add batches, and the thread of events.db writes them. If
// nothing else waits, a batch is written at once. Batches that come during a commit share the next
// one. While the disk fails, batches wait in memory, and the disk is tried again every second;
// their devices are not asked for more events, and keep them. Without a file (in_memory), a batch
// counts as written at once.
//
//   EventLog       this: the thread
//   EventQueue     the way in, for any thread       EventRounds  the way out, for the thread
//   PendingEvents  what both share, with its lock   EventBook    batches not on the disk yet
//   RoundWriter    writes one round                 EventFile    opens the file
//   EventTable     writes its rows
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "gateway/records/events/event_queue.h"
#include "gateway/records/events/event_rounds.h"
#include "gateway/records/events/event_source.h"
#include "gateway/records/events/log_options.h"
#include "gateway/records/events/round_writer.h"

namespace baudgate::events {

class EventLog final : public EventSource {
 public:
  using Options = LogOptions;
  explicit EventLog(Options options);
  /// Writes the events that wait, however long the disk takes.
  ~EventLog() override;

  EventQueue& queue() { return queue_; }

  /// Once a second, from any thread but the writing one. If the disk does not answer in time, this
  /// reports it, and reports the alarms that wait.
  void Watch() { round_writer_.TellAlarms(rounds_.Watch()); }

  EventsState state() const override;
  std::vector<Alarm> Alarms() const override { return queue_.Alarms(); }
  std::size_t Acknowledge(const AckQuery& query,
                          std::function<void(const Acknowledged&)> done) override {
    return queue_.Acknowledge(query, std::move(done));
  }
  Result<Page> Read(const PageQuery& query) const override;
  Result<PastPage> ReadPast(const PastQuery& query) const override;

 private:
  const Options options_;
  PendingEvents pending_;
  EventQueue queue_;
  EventRounds rounds_;
  RoundWriter round_writer_;  // of the writing thread
  Worker worker_;
};

}  // namespace baudgate::events
