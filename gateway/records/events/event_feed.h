// `EventFeed` contains the newest events on the disk, for outputs that must never wait for the
// disk: Modbus shows them (gateway/outputs/modbus/service), DDS takes them in order
// (gateway/outputs/dds). The writing thread of gateway/records/events/event_log.h adds events after
// each commit. A consumer that takes all events has a cursor; events that are no longer in memory
// are read from the file by that thread. An output that only shows events misses these, and can
// count them by their numbers. Events contain the name of their device; its number is looked up
// when an event is taken.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "gateway/base/guarded.h"
#include "gateway/records/events/alarm.h"
#include "gateway/records/events/event_book.h"
#include "gateway/records/events/event_record.h"

namespace baudgate::events {

// `CursorBook` contains the position of each consumer that takes all events, by name. The file
// stores the positions, so a consumer continues there after a restart. Thread-safe.

struct Cursor {
  std::int64_t seq = 0;  ///< the consumer has received this event and all before
  /// True if the consumer has confirmed these events. Else the last events may have been lost when
  /// the gateway was killed.
  bool sure = false;

  bool operator==(const Cursor&) const = default;
};

using Cursors = std::map<std::string, Cursor>;

class CursorBook {
 public:
  /// `consumers`: their names. A cursor in the file with any other name is dropped.
  explicit CursorBook(std::set<std::string> consumers = {}) : consumers_(std::move(consumers)) {}

  /// Returns the cursor; empty: the consumer has never received an event, or is unknown.
  std::optional<Cursor> Of(const std::string& consumer) const;
  /// Sets a cursor, which is on the disk after about a second. Returns true if the file now has to
  /// be written, and had not before.
  bool Set(const std::string& consumer, Cursor cursor);

  // The functions below are for the thread that writes the file.

  /// `due` is called on any thread when the file must be written. Null: no thread writes the file.
  /// When OnDue returns, the previous function is not called any more.
  void OnDue(std::function<void()> due);
  /// Passes the cursors of the opened file. Cursors that are already set take precedence.
  void OnOpened(const Cursors& kept);
  /// Returns all cursors if the file differs from them, else nothing. They replace all cursors in
  /// the file.
  std::optional<Cursors> Due() const;
  void OnKept(const Cursors& kept);
  Cursors all() const;

 private:
  const std::set<std::string> consumers_;
  mutable Mutex mutex_;
  Cursors cursors_ BAUDGATE_GUARDED_BY(mutex_);
  Cursors kept_ BAUDGATE_GUARDED_BY(mutex_);
  Mutex telling_;
  std::function<void()> due_ BAUDGATE_GUARDED_BY(telling_);
};

// `Backlog` passes events from the file to consumers that need older events than those in memory. A
// consumer requests events by the last number that it has received; the writing thread reads them,
// and the consumer takes them here. No lock, no disk.
//
//   Take(40)               → nothing: wanted() is 40
//   Supply(40, {41 … 600})
//   Take(40, 100)          → {41 … 140}, and so on with Take(140)
class Backlog {
 public:
  /// Limit of the pages; above it all are dropped, so a page that no consumer takes does not stay.
  static constexpr std::size_t kMostPages = 8;

  /// Returns events after `after`. nullopt: they are now requested from the file. An empty list:
  /// the file also contains no event after `after`.
  std::optional<std::vector<EventRecord>> Take(std::int64_t after, std::size_t most);
  std::optional<std::int64_t> wanted() const;
  void Supply(std::int64_t after, std::vector<EventRecord> events);

 private:
  std::set<std::int64_t> wanted_;
  std::map<std::int64_t, std::vector<EventRecord>> pages_;  // key: number before the first event
};

// `RecentEvents` contains the newest events, the devices of the events before them, and for each
// device the number of its newest event that is older still. No lock: EventFeed provides it.
//
//   number  1 … 60             61 … 80          81 … 90
//           newest per device  only the device  whole event

struct GoneEvent {
  std::int64_t seq = 0;
  std::string device{};
};

struct FeedLimits {
  std::size_t events = 4000;       ///< about 1 MB
  std::size_t remembered = 16000;  ///< events before these whose device is in memory: 256 kB
};

/// The contents of a file when it is opened, sorted by number.
struct FeedImage {
  std::int64_t newest = 0;
  std::vector<EventRecord> events{};
  std::vector<Alarm> alarms{};
  std::vector<GoneEvent> gone{};
  std::map<std::string, std::int64_t> older{};  ///< newest number of each device before `gone`
};

class RecentEvents {
 public:
  explicit RecentEvents(FeedLimits limits) : limits_(limits) {}

  /// Sets the contents of the file. Must be called before Add.
  void Begin(FeedImage image);
  /// Adds at least one event, sorted by number.
  void Add(std::vector<EventRecord> events);

  bool empty() const { return events_.empty(); }
  std::int64_t newest() const { return newest_; }  ///< newest number of all devices; 0: none
  std::int64_t oldest() const { return events_.front().seq; }

  /// Returns the event number with these low 32 bits that is nearest to the newest number.
  std::int64_t Whole(std::uint32_t number) const;
  /// Returns at most `most` events, sorted by number. `device` null: events of all devices.
  std::vector<EventRecord> Newest(const std::string* device, std::size_t most) const;
  std::vector<EventRecord> From(std::int64_t first, const std::string* device,
                                std::size_t most) const;
  /// Returns how many events from `first` on are no longer in memory. Events so old that their
  /// device is not known count, unless `device` had none in this range.
  std::uint64_t Lost(std::int64_t first, const std::string* device) const;
  /// True if the event after number `after` is no longer in memory.
  bool HasLeft(std::int64_t after) const { return !empty() && after + 1 < oldest(); }

 private:
  struct Gone {
    std::int64_t seq = 0;
    const std::string* device = nullptr;  // points into gone_devices_
  };
  void Forget(std::int64_t seq, const std::string& device);
  void Drop();

  const FeedLimits limits_;
  std::int64_t newest_ = 0;
  std::deque<EventRecord> events_;
  std::deque<Gone> gone_;
  std::set<std::string> gone_devices_;
  std::map<std::string, std::int64_t> older_;
};

// `FeedListeners` wakes outputs when a feed has more events for them. Thread-safe.
class FeedListeners {
 public:
  using Listener = std::uint64_t;
  /// `wake` is called on the thread that fills the feed; it must return at once.
  Listener Listen(std::function<void()> wake) {
    const MutexLock lock(mutex_);
    listeners_.emplace(next_, std::move(wake));
    return next_++;
  }
  /// When Leave returns, `wake` of the listener is not called any more.
  void Leave(Listener listener) {
    const MutexLock lock(mutex_);
    listeners_.erase(listener);
  }
  void Wake() const {
    const MutexLock lock(mutex_);
    for (const auto& [listener, wake] : listeners_) wake();
  }

 private:
  mutable Mutex mutex_;
  std::map<Listener, std::function<void()>> listeners_ BAUDGATE_GUARDED_BY(mutex_);
  Listener next_ BAUDGATE_GUARDED_BY(mutex_) = 1;
};

/// An event, with the number that its device has at the time of Take.
struct FedEvent {
  Source source = kGateway;  ///< kGateway also if the device is no longer configured
  EventRecord record{};
};

class EventFeed {
 public:
  explicit EventFeed(FeedLimits limits = {}) : recent_(limits) {}

  /// Sets the contents of the opened file. Does nothing if the feed contains events: the file was
  /// opened again.
  void Begin(FeedImage image);
  /// Adds events that are on the disk, sorted by number.
  void Add(std::vector<EventRecord> events);
  /// Sets the numbers of the sources. Before the first call no device has a number.
  void Renumber(const SourceNames& sources);
  /// Returns the listeners, which are woken after Begin, Add and Supply.
  FeedListeners& listeners() { return listeners_; }

  struct Page {
    std::int64_t newest = 0;  ///< newest number of all devices; 0: none
    std::int64_t oldest = 0;  ///< oldest number in memory, of all devices
    std::uint64_t lost = 0;   ///< events of `source` from `first` on that are no longer in memory
    std::vector<EventRecord> events{};  ///< at most `most`, sorted by number
  };
  /// Returns events of one device or of all, from number `first` on (low 32 bits); 0: the newest.
  /// Events so old that their device is not known count as lost, unless the device had none then.
  Page Show(std::optional<Source> source, std::uint32_t first, std::size_t most) const;

  /// Returns events of all devices after number `after`. None if they must first be read from the
  /// file; the listeners are woken when they are in memory.
  std::vector<FedEvent> Take(std::int64_t after, std::size_t most);
  std::int64_t newest() const;

  /// Returns the alarms, which are updated before the listeners are woken.
  const AlarmBoard& alarms() const { return alarms_; }

  /// The functions below are for the writing thread. `asked` is called on any thread when events
  /// are to be read from the file. Null: the file is not read. When ServeWith returns, the previous
  /// function is not called any more.
  void ServeWith(std::function<void()> asked);
  /// Returns the number after which events are to be read; empty: no request.
  std::optional<std::int64_t> wanted() const;
  void Supply(std::int64_t after, std::vector<EventRecord> events);

 private:
  FedEvent Numbered(EventRecord record) const BAUDGATE_REQUIRES(mutex_);
  bool IsServed() const;

  mutable Mutex mutex_;
  RecentEvents recent_ BAUDGATE_GUARDED_BY(mutex_);
  std::map<std::string, Source> numbers_ BAUDGATE_GUARDED_BY(mutex_);
  Backlog backlog_ BAUDGATE_GUARDED_BY(mutex_);
  AlarmBoard alarms_;
  mutable Mutex asking_;
  std::function<void()> asked_ BAUDGATE_GUARDED_BY(asking_);
  FeedListeners listeners_;
};

}  // namespace baudgate::events
