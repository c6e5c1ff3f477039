// Queue between event producers and the writer thread: the book under a lock, who waits for it, and
// how the disk does. From any thread; the second half is of the thread that writes
// (gateway/events/event_log.h).
//
//   Add, Tell, Acknowledge, …        Begin → Take → (to the disk) → Done
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/guarded.h"
#include "gateway/events/ack_service.h"
#include "gateway/events/event_book.h"
#include "gateway/events/event_source.h"
#include "gateway/events/log_options.h"
#include "gateway/events/own_run.h"
#include "gateway/events/round_timer.h"
#include "gateway/events/source_numbers.h"
#include "gateway/events/watched.h"
#include "gateway/state/disk_condition.h"
#include "gateway/state/file_watch.h"

namespace baudgate::events {

class EventQueue {
 public:
  static constexpr Duration kTick = 1s;

  /// `options` outlive it. `wake`: there is something to be written, or it is time to look.
  EventQueue(const LogOptions& options, std::function<void()> wake);

  /// Returns at once, as all up to End.
  void Add(Batch batch);
  /// An event of the gateway's own; it is left out where there are too many like it.
  void Tell(EventRecord record);
  /// All of it is in the file then, or none; what is there already is left as it is.
  void Keep(KeptRecord record);
  /// The gateway has started: told before all else, with how the one before has ended. So is then
  /// its end.
  void Started(const std::string& version);
  /// The gateway ends, and outputs may hear of it: returns when the end is on the disk, when the
  /// disk fails, or after `most`.
  void End(Duration most);
  std::size_t Acknowledge(const AckQuery& query, AckService::Done done);
  /// `opened` is called once, when the file has opened: on the writing thread, or from here.
  void WhenOpened(std::function<void()> opened);
  bool opened() const {
    const MutexLock lock(mutex_);
    return book_.opened();
  }
  /// A reload: all sources by their numbers; one that is gone has no names. What is known of a
  /// source goes with its names. Alarms that are not watched any more end, as at a start.
  void Renumber(SourceNames sources, Watched watches);
  /// Once a second, from any thread but the one that writes: that one may hang. From time to time
  /// the file is looked at. What waits while the disk does not answer in time; else nothing. Those
  /// that are not `told` are about to be.
  std::vector<Batch> Watch();
  /// A round is due: `now`, or within a tick.
  void Look(bool now);
  /// A reader has found that the file is damaged.
  void Doubt() const;

  /// The text of the source's last batch in the file. Valid once the file is open.
  std::string said(Source source) const;
  EventsState state() const;
  /// While the disk fails as they will be there.
  std::vector<Alarm> Alarms() const;

  /// False: no round is due yet.
  bool Begin();
  /// When the next round is due, unless something comes before.
  Instant NextRound() const;
  /// The gateway's own end, if nobody has told it yet.
  void TellEndOnce();
  /// Whether it is the first time.
  bool OnOpened(const EventTable::Contents& contents);

  /// Others than before, from now on.
  std::optional<SourceNames> TakeNumbers();
  /// What shares the next commit.
  struct Round {
    FileWatch::Look look{};
    std::vector<Batch> batches{};
    std::vector<KeptRecord> records{};
    std::vector<AckService::Ack> acks{};
    std::optional<SourceNames> numbers{};  ///< of these batches, where they are others than before
    bool ends_alarms = false;  ///< that are not watched any more, when these batches are kept
  };
  Round Take();
  void SetPutAside(std::vector<std::string> files);
  /// All of it is on the disk, or why not; `oldest` that the file has. The sources that may be
  /// asked for more.
  std::vector<Source> Done(Round& round, const Status& status, std::int64_t oldest = 0);
  /// The disk fails: what waits, and what it makes of alarms. Of those whose batches are not `told`
  /// it is about to be.
  std::vector<Batch> Unsaved();
  /// More is to be written, and can be.
  bool goes_on() const;
  /// One line for each kind of what is not on the disk and will not be.
  std::vector<std::string> LeftBehind() const;

 private:
  void SetDisk(Disk disk, const std::string& trouble) BAUDGATE_REQUIRES(mutex_);
  bool IsIdle() const BAUDGATE_REQUIRES(mutex_);
  Instant NextRoundAt() const BAUDGATE_REQUIRES(mutex_);
  void TellEnd() BAUDGATE_REQUIRES(mutex_);

  const LogOptions& options_;
  const std::function<void()> wake_;
  mutable Mutex mutex_;
  std::condition_variable done_;
  EventBook book_ BAUDGATE_GUARDED_BY(mutex_);
  SourceNumbers numbers_ BAUDGATE_GUARDED_BY(mutex_);
  std::vector<KeptRecord> records_ BAUDGATE_GUARDED_BY(mutex_);  // that wait
  WatchedAlarms watched_ BAUDGATE_GUARDED_BY(mutex_);
  AckService acks_ BAUDGATE_GUARDED_BY(mutex_);  // of what waits
  OwnRun run_ BAUDGATE_GUARDED_BY(mutex_);
  DiskCondition disk_ BAUDGATE_GUARDED_BY(mutex_);
  mutable FileWatch watch_ BAUDGATE_GUARDED_BY(mutex_);
  RoundTimer timer_ BAUDGATE_GUARDED_BY(mutex_);
  std::int64_t oldest_ BAUDGATE_GUARDED_BY(mutex_) = 0;  // that the file has
  std::function<void()> tell_opened_ BAUDGATE_GUARDED_BY(mutex_);
};

}  // namespace baudgate::events
