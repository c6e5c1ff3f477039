// The newest events that are on the disk, for outputs that must never wait for it: Modbus looks at
// them (gateway/modbus/service), DDS takes them in order (gateway/dds). Filled by the writing
// thread of gateway/events/event_log.h after each commit, never before. A consumer that takes all
// of them has a cursor; events that are no longer in memory it gets from the file, by way of that
// thread. A consumer that only looks misses these, and can count them by their numbers. Events have
// the names of their devices; the number of a device is looked up when it is asked for.
//
//   number  1 … 60   61 … 80          81 … 90
//           old      only the device  whole
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
#include "gateway/events/event_record.h"
#include "gateway/events/source_numbers.h"

namespace baudgate::events {

/// An event with the number that its device has when the event is taken.
struct FedEvent {
  Source source = kGateway;  ///< also if the device is no longer configured
  EventRecord record{};
};

/// The device of an event that is no longer shown.
struct GoneEvent {
  std::int64_t seq = 0;
  std::string device{};
};

struct FeedLimits {
  std::size_t events = 4000;       ///< about 1 MB
  std::size_t remembered = 16000;  ///< devices of the events before these: 256 kB
};

/// What a file holds when it is opened; both by their numbers.
struct FeedImage {
  std::int64_t newest = 0;
  std::vector<EventRecord> events{};
  std::vector<Alarm> alarms{};
  std::vector<GoneEvent> gone{};
  std::map<std::string, std::int64_t> older{};  ///< the newest of each device before these
};

class EventFeed {
 public:
  /// `consumers`: names of those with a cursor.
  explicit EventFeed(FeedLimits limits = {}, std::set<std::string> consumers = {})
      : limits_(limits), cursors_(std::move(consumers)) {}

  /// Does nothing if there are events already: the file was opened again.
  void Begin(FeedImage image);
  /// These events are on the disk, in order of their numbers.
  void Add(std::vector<EventRecord> events);
  /// The sources have these numbers from now on. Before the first call no device has one.
  void Renumber(const SourceNames& sources);
  using Listener = std::uint64_t;
  /// `wake` is called after Begin, Add and Supply, on the writing thread; it returns at once.
  Listener Listen(std::function<void()> wake);
  /// When this returns, it is not called any more.
  void Leave(Listener listener);

  struct Shown {
    std::int64_t newest = 0;  ///< of all devices; 0: none
    std::int64_t oldest = 0;  ///< that can be shown, of all devices
    std::uint64_t lost = 0;   ///< events of `source` after the first asked for that cannot be shown
    std::vector<EventRecord> events{};  ///< at most `most`, by their numbers
  };
  /// Events of one device or of all, from this number on (its low 32 bits); 0: the newest. Events
  /// so old that their device is not known count as lost, unless the device had none then.
  Shown Show(std::optional<Source> source, std::uint32_t first, std::size_t most) const;

  /// Events of all devices after `after`, at most `most`. Also none if they must be read from the
  /// file first: listeners are woken when they are there.
  std::vector<FedEvent> Take(std::int64_t after, std::size_t most);
  std::int64_t newest() const;

  /// The new states of alarms; called before the listeners are woken.
  const AlarmBoard& alarms() const { return alarms_; }

  /// The position of the consumer; after Begin.
  std::optional<Cursor> cursor(const std::string& consumer) const { return cursors_.Of(consumer); }
  /// On the disk within a second or so.
  void SetCursor(const std::string& consumer, Cursor cursor);

  /// The rest is for the thread that writes the file. `asked` is called on any thread; `now`:
  /// events are to be read, else cursors are to be written. Null: the file is not read.
  void ServeWith(std::function<void(bool now)> asked);
  CursorBook& cursors() { return cursors_; }
  /// The number after which events are to be read; empty: none are.
  std::optional<std::int64_t> wanted() const;
  void Supply(std::int64_t after, std::vector<EventRecord> events);

 private:
  struct Gone {
    std::int64_t seq = 0;
    const std::string* device = nullptr;  // in gone_devices_
  };
  void Forget(std::int64_t seq, const std::string& device) BAUDGATE_REQUIRES(mutex_);
  void Drop() BAUDGATE_REQUIRES(mutex_);
  std::int64_t Whole(std::uint32_t number) const BAUDGATE_REQUIRES(mutex_);
  std::uint64_t Lost(const std::string* device, std::int64_t first) const BAUDGATE_REQUIRES(mutex_);
  FedEvent Numbered(EventRecord record) const BAUDGATE_REQUIRES(mutex_);
  bool HasLeft(std::int64_t after) const BAUDGATE_REQUIRES(mutex_);
  void Wake() const;
  void Ask(bool now) const;
  bool IsServed() const;

  const FeedLimits limits_;
  mutable Mutex mutex_;
  std::int64_t newest_ BAUDGATE_GUARDED_BY(mutex_) = 0;
  std::deque<EventRecord> events_ BAUDGATE_GUARDED_BY(mutex_);
  std::deque<Gone> gone_ BAUDGATE_GUARDED_BY(mutex_);
  std::set<std::string> gone_devices_ BAUDGATE_GUARDED_BY(mutex_);
  std::map<std::string, std::int64_t> older_ BAUDGATE_GUARDED_BY(mutex_);
  std::map<Source, std::string> devices_ BAUDGATE_GUARDED_BY(mutex_);
  std::map<std::string, Source> numbers_ BAUDGATE_GUARDED_BY(mutex_);  // the same, by name
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
