// The events while the gateway runs: batches come from the lines, and the thread of events.db
// writes them. The first batch of an idle queue is written at once; all that come while the disk is
// busy share the next commit. While the disk fails they wait in memory, and it is tried again every
// second; their devices are not asked for more, and keep their events. Without a file (in_memory) a
// batch is done at once.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "gateway/events/event_file.h"
#include "gateway/events/event_queue.h"
#include "gateway/events/event_source.h"
#include "gateway/events/log_options.h"

namespace baudgate::events {

class EventLog final : public EventSource {
 public:
  using Options = LogOptions;
  explicit EventLog(Options options);
  /// Writes what is left; as long as the disk takes.
  ~EventLog() override;

  /// The entrance of all events.
  EventQueue& queue() { return queue_; }

  /// Once a second, from any thread but the writing one. If the disk does not answer in time, this
  /// reports it, and reports the alarms that wait.
  void Watch() { TellAlarms(queue_.Watch()); }

  EventsState state() const override;
  std::vector<Alarm> Alarms() const override { return queue_.Alarms(); }
  std::size_t Acknowledge(const AckQuery& query,
                          std::function<void(const Acknowledged&)> done) override {
    return queue_.Acknowledge(query, std::move(done));
  }
  Result<Page> Read(const PageQuery& query) const override;
  Result<PastPage> ReadPast(const PastQuery& query) const override;

 private:
  Instant Round(bool last);
  void WriteDue();
  Status Open();
  Status Write(EventQueue::Round& round);
  void TellAlarms(const std::vector<Batch>& batches) const;
  void Feed(const std::vector<Batch>& batches);
  void TellOwed(const std::vector<Batch>& batches) const;
  void ReadBacklog();

  const Options options_;
  const std::shared_ptr<EventsWriter> writer_;
  EventQueue queue_;
  SourceNames sources_;  // of the writing thread
  EventFile file_;       // of the writing thread
  Worker worker_;
};

}  // namespace baudgate::events
