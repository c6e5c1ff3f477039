// `EventLog` stores events while the gateway runs: lines add batches, and the thread of events.db
// writes them. If nothing else waits, a batch is written at once; batches that come during a commit
// share the next commit. While the disk fails, batches wait in memory, and writing is tried again
// every second; the devices are not asked for more events and store them. Without a file
// (in_memory), a batch counts as written at once.
//
//   EventLog       owns the parts and the thread
//   EventQueue     input, for any thread               EventRounds  output, for the thread
//   PendingEvents  data of these two, with the lock    EventBook    batches not on the disk yet
//   RoundWriter    writes one round                    EventFile    opens the file
//   EventTable     writes the rows
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/base/worker.h"
#include "gateway/records/disk/disk.h"
#include "gateway/records/events/event_file.h"
#include "gateway/records/events/event_queue.h"
#include "gateway/records/events/event_source.h"

namespace baudgate::events {

// `RoundTimer` computes when the thread that writes events runs next:
//
//   the disk           events wait               nothing waits
//   fails              at the time of Rest       at the time of Rest
//   works              at once                   at the time of Look, or of left-out events
class RoundTimer {
 public:
  /// Makes a round (one commit) due at `at`, or earlier if an earlier round is already due.
  void Look(Instant at) { look_at_ = look_at_ ? std::min(*look_at_, at) : at; }
  /// To be called when a commit has failed. As long as the disk fails, the next round is due at
  /// `until`.
  void Rest(Instant until) { rests_until_ = until; }
  void Begin() { look_at_.reset(); }
  /// Returns when the next round is due. `fails`: the disk fails. `idle`: nothing waits.
  /// `left_out_at`: when events that Shares has left out have to be added.
  Instant At(bool fails, bool idle, std::optional<Instant> left_out_at) const {
    if (fails) return rests_until_;
    if (!idle) return {};
    return std::min(left_out_at.value_or(kWhenWoken), look_at_.value_or(kWhenWoken));
  }

 private:
  std::optional<Instant> look_at_;
  Instant rests_until_{};
};

// `EventRounds` manages the rounds of the writing thread (a round is one commit): when a round is
// due, which batches it takes, and what follows from its result. Only this thread is allowed to
// call it, except for Watch, Look and Doubt (any thread), and LeftBehind (after the end of the
// thread).
//
//   Begin → OnOpened, if the file was closed → Take → (to the disk) → Done
class EventRounds {
 public:
  /// `options` and `pending` must outlive this object.
  EventRounds(const LogOptions& options, PendingEvents& pending);

  /// To be called once a second by any thread but the writing thread, which can hang. At every
  /// tenth call, the next round checks the file. If the disk does not answer in time, returns the
  /// batches that wait; the caller must report the alarms of each batch whose `told` is false.
  std::vector<Batch> Watch();
  /// Makes the next round of the writing thread (one commit) due: at once if `now` is true, else in
  /// a second. Thread-safe.
  void Look(bool now);
  /// Requests a check of the whole file because a reader has found damage. Thread-safe.
  void Doubt() const;

  /// Begins a round. Returns false if no round is due yet.
  bool Begin();
  Instant NextRound() const;
  /// Returns true at the first opening of the file.
  bool OnOpened(const EventTable::Contents& contents);
  void SetPutAside(std::vector<std::string> files);

  struct Round {
    records::FileWatch::Look look{};
    std::vector<Batch> batches{};
    std::vector<KeptRecord> records{};
    std::vector<WaitingAck> acks{};
    bool ends_alarms = false;  ///< a reload ends or changes alarms after this commit
  };
  Round Take();
  /// Ends the round. If `status` is not an error, the round is on the disk. `oldest`: number of the
  /// first event in the file; 0: not known. Returns the sources that can be asked for more events.
  std::vector<Source> Done(Round& round, const Status& status, std::int64_t oldest = 0);
  /// To be called after a failure. Returns the batches that wait, as Watch does.
  std::vector<Batch> Unsaved();
  bool goes_on() const;
  /// Returns log lines about events that are not on the disk: one for devices, one for the gateway.
  /// To be called after the thread has ended.
  std::vector<std::string> LeftBehind() const;

 private:
  static constexpr Duration kTick = 1s;

  void SetDisk(records::Disk disk, const std::string& trouble) BAUDGATE_REQUIRES(pending_.mutex);
  Instant NextRoundAt() const BAUDGATE_REQUIRES(pending_.mutex);

  const LogOptions& options_;
  PendingEvents& pending_;
  mutable records::FileWatch watch_ BAUDGATE_GUARDED_BY(pending_.mutex);
  RoundTimer timer_ BAUDGATE_GUARDED_BY(pending_.mutex);
};

// `RoundWriter` executes the rounds of the writing thread: it opens the file and writes what waits.
// Then it informs outputs (by the feed), lines, receivers of alarms, and clients that wait for
// acknowledgements. Used by the writing thread, unless a comment states otherwise.
class RoundWriter {
 public:
  /// All references must outlive this object. `options.writer` must be set.
  RoundWriter(const LogOptions& options, const EventQueue& queue, EventRounds& rounds);

  /// Executes a round if one is due. `last`: executes rounds until nothing waits or the disk fails.
  /// Returns when the next round is due.
  Instant Run(bool last);
  /// Connects the feed and the cursors, so that outputs can make a round due. Must be called first.
  void Serve();
  /// Undoes Serve. To be called before the last round, on another thread.
  void StopServing();
  /// Reports the alarms that have changed in the batches whose `told` is false. Thread-safe.
  void TellAlarms(const std::vector<Batch>& batches) const;
  /// Returns the consumers with their positions. Thread-safe. `oldest`: number of the first event
  /// in the file.
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
  EventFeed* const feed_;
  CursorBook* const cursors_;
};

class EventLog final : public EventSource {
 public:
  using Options = LogOptions;
  explicit EventLog(Options options);
  /// Writes the events that wait, however long the disk takes. Logs which events cannot be written.
  ~EventLog() override;

  EventQueue& queue() { return queue_; }

  /// To be called once a second by any thread but the writing thread. If the disk does not answer
  /// in time, logs this, and reports the alarms of the batches that wait.
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
  RoundWriter round_writer_;
  Worker worker_;
};

}  // namespace baudgate::events
