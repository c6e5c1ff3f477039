// The newest events that are on the disk, for outputs that must never wait for it: Modbus looks at
// them (gateway/modbus/desk), DDS takes them in order (gateway/dds). Filled by the writing thread
// of gateway/events/event_log.h after each commit, never before; each output keeps its own place,
// and one that is slow misses what has left, by numbers that it can count.
//
//   number  1 … 60   61 … 80         81 … 90
//           old      whose they were  shown whole
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "gateway/base/guarded.h"
#include "gateway/events/event_book.h"
#include "gateway/events/event_record.h"

namespace baudgate::events {

struct FedEvent {
  Source source = kGateway;  ///< also where the device is no longer configured
  EventRecord record{};
};

/// An event that is no longer shown: whose it was.
struct GoneEvent {
  std::int64_t seq = 0;
  Source source = kGateway;
};

struct FeedLimits {
  std::size_t events = 4000;       ///< about 1 MB
  std::size_t remembered = 16000;  ///< before these, whose they were: 256 kB
};

/// What a file holds when it is opened; both by their numbers.
struct FeedImage {
  std::int64_t newest = 0;
  std::vector<FedEvent> events{};
  std::vector<GoneEvent> gone{};
  std::map<Source, std::int64_t> older{};  ///< the newest of each device before these
};

class EventFeed {
 public:
  explicit EventFeed(FeedLimits limits = {}) : limits_(limits) {}

  /// Nothing where events are there already: the file is opened once more.
  void Begin(FeedImage image);
  /// They are on the disk, by their numbers.
  void Add(const std::vector<FedEvent>& events);
  /// Sources have other numbers, by those of before.
  void Move(const std::map<Source, Source>& moved);
  /// `wake` is called after each of these, on the writing thread; it returns at once. Null: no
  /// longer, and no call is under way when this returns.
  void OnNew(std::function<void()> wake);

  struct Shown {
    std::int64_t newest = 0;  ///< of all devices; 0: none
    std::int64_t oldest = 0;  ///< that can be shown, of all devices
    std::uint64_t lost = 0;   ///< of `source`, from the first asked for on, that can not be shown
    std::vector<EventRecord> events{};  ///< at most `most`, by their numbers
  };
  /// Of one device, or of all, from this number on (of a longer one the low 32 bits); 0: the
  /// newest. What is so old that it is not known whose it was counts as lost, unless the device had
  /// none then.
  Shown Show(std::optional<Source> source, std::uint32_t first, std::size_t most) const;

  /// Those behind `after`, of all devices, at most `most`.
  std::vector<FedEvent> Take(std::int64_t after, std::size_t most) const;
  std::int64_t newest() const;

 private:
  void Drop() BAUDGATE_REQUIRES(mutex_);
  std::int64_t Whole(std::uint32_t number) const BAUDGATE_REQUIRES(mutex_);
  std::uint64_t Lost(std::optional<Source> source, std::int64_t first) const
      BAUDGATE_REQUIRES(mutex_);
  void Wake() const;

  const FeedLimits limits_;
  mutable Mutex mutex_;
  std::int64_t newest_ BAUDGATE_GUARDED_BY(mutex_) = 0;
  std::deque<FedEvent> events_ BAUDGATE_GUARDED_BY(mutex_);
  std::deque<GoneEvent> gone_ BAUDGATE_GUARDED_BY(mutex_);
  std::map<Source, std::int64_t> older_ BAUDGATE_GUARDED_BY(mutex_);
  mutable Mutex waking_;
  std::function<void()> wake_ BAUDGATE_GUARDED_BY(waking_);
};

}  // namespace baudgate::events
