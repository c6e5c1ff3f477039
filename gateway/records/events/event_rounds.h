// The rounds of the thread that writes events: when a round is due, what it takes, and what follows
// from its end. Only that thread calls this, except for Watch, Look and Doubt, and for LeftBehind,
// which is called after its end.
//
//   Begin → OnOpened, if the file was closed → Take → (to the disk) → Done
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "gateway/records/disk/file_watch.h"
#include "gateway/records/events/pending_events.h"
#include "gateway/records/events/round_timer.h"

namespace baudgate::events {

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
    FileWatch::Look look{};
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

  void SetDisk(Disk disk, const std::string& trouble) BAUDGATE_REQUIRES(pending_.mutex);
  Instant NextRoundAt() const BAUDGATE_REQUIRES(pending_.mutex);

  const LogOptions& options_;
  PendingEvents& pending_;
  mutable FileWatch watch_ BAUDGATE_GUARDED_BY(pending_.mutex);
  RoundTimer timer_ BAUDGATE_GUARDED_BY(pending_.mutex);
};

}  // namespace baudgate::events
