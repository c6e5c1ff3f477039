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
//
// RoundTimer says when the thread is due.
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

// When the thread that writes events is due again.
//
//   the disk           there is work          there is none
//   fails              after a rest           after a rest
//   works              at once                at the time of a look, or of what was left out
//
class RoundTimer {
 public:
  /// A round is due then, or earlier.
  void Look(Instant at) { look_at_ = look_at_ ? std::min(*look_at_, at) : at; }
  /// The disk has failed, and is left in peace until then.
  void Rest(Instant until) { rests_until_ = until; }
  /// It has begun.
  void Begin() { look_at_.reset(); }
  /// `left_out_at`: when events that were left out are to be told.
  Instant At(bool fails, bool idle, std::optional<Instant> left_out_at) const {
    if (fails) return rests_until_;
    if (!idle) return {};
    return std::min(left_out_at.value_or(kWhenWoken), look_at_.value_or(kWhenWoken));
  }

 private:
  std::optional<Instant> look_at_;
  Instant rests_until_{};
};

// The rounds of the thread that writes events: when a round is due, what it takes, and what follows
// from its end. Only that thread calls this, except for Watch, Look and Doubt, and for LeftBehind,
// which is called after its end.
//
//   Begin → OnOpened, if the file was closed → Take → (to the disk) → Done
//
class EventRounds {
 public:
  /// `options` and `pending` outlive it.
  EventRounds(const LogOptions& options, PendingEvents& pending);

  /// To be called once a second, by any thread but the writing one, which may hang. Makes a round
  /// look at the file from time to time. If the disk does not answer in time, returns the batches
  /// that wait: the caller reports the alarms of those that are not marked as `told`.
  std::vector<Batch> Watch();
  /// Makes a round due, `now` or in a second. From any thread.
  void Look(bool now);
  /// A reader has found that the file is damaged. From any thread.
  void Doubt() const;

  /// False: no round is due yet.
  bool Begin();
  /// When the next round is due, if nothing wakes the thread before.
  Instant NextRound() const;
  /// Returns whether the file has opened for the first time.
  bool OnOpened(const EventTable::Contents& contents);
  void SetPutAside(std::vector<std::string> files);

  /// The content of one commit, and the requests that wait for it.
  struct Round {
    records::FileWatch::Look look{};
    std::vector<Batch> batches{};
    std::vector<KeptRecord> records{};
    std::vector<WaitingAck> acks{};
    bool ends_alarms = false;  ///< after this commit, alarms that nobody watches any more end
  };
  Round Take();
  /// The round is on the disk, or `status` says why not. `oldest`: number of the first event in the
  /// file; 0: not known. Returns the sources that may be asked for more events.
  std::vector<Source> Done(Round& round, const Status& status, std::int64_t oldest = 0);
  /// For a disk that fails: returns the batches that wait, as Watch does.
  std::vector<Batch> Unsaved();
  /// There is more to write, and the disk works.
  bool goes_on() const;
  /// When the thread has ended: one line for each kind of events that are not on the disk.
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

// Writes the rounds of the events: the file is opened, what is due is written, and then all others
// are told: outputs by the feed, lines, alarms, clients that wait. On the writing thread, unless it
// says otherwise.
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
