// Events that are not on the disk yet: what the writing thread takes from, and what waits here
// while the disk fails. Gives out the numbers, and knows a batch that comes once more. No thread,
// no lock, no disk: gateway/events/event_log.h has them.
//
//   Add({source 3, "12.345 0E1", again, {r}})
//   Due()   → {source 3, {r, seq 1}}     to be inserted; without events where the last batch of
//                                        source 3 that was kept said the same
//   Kept()  → {3}                        it may be asked for more
//
// Bounded: a source is not asked again before its batch is kept, so that one of each waits at most.
// What has no source to wait for it (the gateway's own events, of a later day) needs a limit here.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "gateway/events/event_record.h"

namespace baudgate::events {

using Source = std::uint32_t;  ///< a device, as in the point store

struct Batch {
  Source source = 0;
  std::string said{};  ///< see EventBatch
  bool again = false;
  std::vector<EventRecord> events{};
};

class EventBook {
 public:
  void Add(Batch batch);

  /// What the file holds: its last number, and what each source has said last. What the book knows
  /// of them itself goes before: a new file may have begun.
  void OnOpened(std::int64_t last, const std::map<Source, std::string>& said);

  /// What waits, in the order of Add, with its numbers. The same until Kept. After OnOpened.
  std::vector<Batch> Due();
  /// The first so many that wait are on the disk. Their sources, in their order.
  std::vector<Source> Kept(std::size_t batches);

  /// What the last batch of the source that is kept has said; empty: none is.
  std::string said(Source source) const;
  std::size_t waiting() const { return waiting_.size(); }
  std::int64_t newest() const { return last_; }       ///< that is on the disk
  std::uint64_t repeats() const { return repeats_; }  ///< events that came once more

 private:
  bool IsRepeat(const Batch& batch, const std::map<Source, std::string>& said) const;

  std::deque<Batch> waiting_;
  std::map<Source, std::string> said_;  // last, and kept
  std::int64_t last_ = 0;
  std::uint64_t repeats_ = 0;
};

}  // namespace baudgate::events
