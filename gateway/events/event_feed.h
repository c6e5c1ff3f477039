// The newest events that are on the disk, for outputs that must never wait for it: Modbus looks at
// them (gateway/modbus/service), DDS takes them in order (gateway/dds). Filled by the writing
// thread of gateway/events/event_log.h after each commit, never before. A consumer that takes all
// of them has a cursor, and gets from the file what has left the memory, by way of that thread. One
// that only looks misses it, by numbers that it can count.
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
#include <set>
#include <string>
#include <vector>

#include "gateway/base/guarded.h"
#include "gateway/events/alarm_board.h"
#include "gateway/events/backlog.h"
#include "gateway/events/cursors.h"
#include "gateway/events/event_book.h"
#include "gateway/events/event_record.h"

namespace baudgate::events {

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
  std::vector<Alarm> alarms{};
  std::vector<GoneEvent> gone{};
  std::map<Source, std::int64_t> older{};  ///< the newest of each device before these
};

class EventFeed {
 public:
  /// `consumers`: those with a cursor.
  explicit EventFeed(FeedLimits limits = {}, std::set<std::string> consumers = {})
      : limits_(limits), cursors_(std::move(consumers)) {}

  /// Nothing where events are there already: the file is opened once more.
  void Begin(FeedImage image);
  /// They are on the disk, by their numbers.
  void Add(const std::vector<FedEvent>& events);
  using Listener = std::uint64_t;
  /// Sources have other numbers, by those of before.
  void Move(const std::map<Source, Source>& moved);
  /// `wake` is called after each of these, on the writing thread; it returns at once.
  Listener Listen(std::function<void()> wake);
  /// It is called no longer, and no call is under way when this returns.
  void Leave(Listener listener);

  struct Shown {
    std::int64_t newest = 0;  ///< of all devices; 0: none
    std::int64_t oldest = 0;  ///< that can be shown, of all devices
    std::uint64_t lost = 0;   ///< of `source`, from the first asked for on, that cannot be shown
    std::vector<EventRecord> events{};  ///< at most `most`, by their numbers
  };
  /// Events of one device or of all, from this number on (of a longer one the low 32 bits); 0: the
  /// newest. What is so old that it is not known whose it was counts as lost, unless the device had
  /// none then.
  Shown Show(std::optional<Source> source, std::uint32_t first, std::size_t most) const;

  /// Those behind `after`, of all devices, at most `most`. None also where they have to be read
  /// from the file first: listeners are woken then.
  std::vector<FedEvent> Take(std::int64_t after, std::size_t most);
  std::int64_t newest() const;

  /// What the events have made of the alarms; before the listeners are woken.
  const AlarmBoard& alarms() const { return alarms_; }

  /// Where the consumer was; after Begin.
  std::optional<Cursor> cursor(const std::string& consumer) const { return cursors_.Of(consumer); }
  /// On the disk within a second or so.
  void SetCursor(const std::string& consumer, Cursor cursor);

  /// The rest is of the thread that writes the file. `asked` is called on any thread: `now`: some
  /// events are to be read, else there are cursors to be written. Null: nobody reads the file.
  void ServeWith(std::function<void(bool now)> asked);
  CursorBook& cursors() { return cursors_; }
  /// Behind which events are to be read; nothing: none are.
  std::optional<std::int64_t> wanted() const;
  void Supply(std::int64_t after, std::vector<FedEvent> events);

 private:
  void Drop() BAUDGATE_REQUIRES(mutex_);
  std::int64_t Whole(std::uint32_t number) const BAUDGATE_REQUIRES(mutex_);
  std::uint64_t Lost(std::optional<Source> source, std::int64_t first) const
      BAUDGATE_REQUIRES(mutex_);
  bool HasLeft(std::int64_t after) const BAUDGATE_REQUIRES(mutex_);
  void Wake() const;
  void Ask(bool now) const;
  bool IsServed() const;

  const FeedLimits limits_;
  mutable Mutex mutex_;
  std::int64_t newest_ BAUDGATE_GUARDED_BY(mutex_) = 0;
  std::deque<FedEvent> events_ BAUDGATE_GUARDED_BY(mutex_);
  std::deque<GoneEvent> gone_ BAUDGATE_GUARDED_BY(mutex_);
  std::map<Source, std::int64_t> older_ BAUDGATE_GUARDED_BY(mutex_);
  Backlog backlog_ BAUDGATE_GUARDED_BY(mutex_);
  AlarmBoard alarms_;
  CursorBook cursors_;
  mutable Mutex asking_;
  std::function<void(bool now)> asked_ BAUDGATE_GUARDED_BY(asking_);
  mutable Mutex waking_;
  std::map<Listener, std::function<void()>> listeners_ BAUDGATE_GUARDED_BY(waking_);
  Listener next_ BAUDGATE_GUARDED_BY(waking_) = 1;
};

}  // namespace baudgate::events
