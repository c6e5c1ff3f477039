// `EventFeed` contains the newest events on the disk, for outputs that must never wait for the
// disk: Modbus shows them (gateway/outputs/modbus/service), DDS takes them in order
// (gateway/outputs/dds). After each commit, the writing thread of
// gateway/records/events/event_log.h adds events. A consumer that takes all events has a cursor;
// for this consumer the writing thread reads events from the file that are no longer in memory. An
// output without a cursor misses these events, and can count them by their numbers. An event
// contains the name of its device; the device's number is looked up when the event is taken.
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

// `CursorBook` contains the position of each consumer that takes all events, by the consumer's
// name. The file stores the positions, so a consumer continues at its position after a restart.
// Thread-safe.

struct Cursor {
  std::int64_t seq = 0;  ///< the consumer has received the event of this number and all before
  /// True if the consumer has confirmed these events. False: the last events may have been lost
  /// when the gateway was killed.
  bool sure = false;

  bool operator==(const Cursor&) const = default;
};

using Cursors = std::map<std::string, Cursor>;

class CursorBook {
 public:
  /// `consumers`: the names of the consumers. A cursor in the file with any other name is dropped.
  explicit CursorBook(std::set<std::string> consumers = {}) : consumers_(std::move(consumers)) {}

  std::optional<Cursor> Of(const std::string& consumer) const;
  /// Sets a position, which is on the disk after about a second. Ignores an unknown consumer.
  /// Returns true if the positions in the file were up to date before this call and are not now.
  bool Set(const std::string& consumer, Cursor cursor);

  // Only the thread that writes the file calls the functions below.

  /// `due` is called on any thread when the file must be written. Null: no thread writes the file.
  /// When OnDue has returned, the previous function is not called any more.
  void OnDue(std::function<void()> due);
  /// Sets the positions that the opened file contains. Positions that are already set take
  /// precedence.
  void OnOpened(const Cursors& kept);
  /// Returns all positions if the file differs from them, else nothing. They replace all positions
  /// in the file.
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
// consumer requests events by the last number that it has received; the writing thread reads them
// and calls Supply, and the consumer takes them here. No lock, no disk.
//
//   Take(40)               → nothing: wanted() is 40
//   Supply(40, {41 … 600})
//   Take(40, 100)          → {41 … 140}, and so on with Take(140)
class Backlog {
 public:
  /// The limit of pages in memory. At the limit all pages are dropped, so that a page that no
  /// consumer takes does not stay.
  static constexpr std::size_t kMostPages = 8;

  /// Returns the events after number `after`. nullopt: they are not in memory, and are now
  /// requested from the file. An empty list: the file contains no event after `after`.
  std::optional<std::vector<EventRecord>> Take(std::int64_t after, std::size_t most);
  std::optional<std::int64_t> wanted() const;
  void Supply(std::int64_t after, std::vector<EventRecord> events);

 private:
  std::set<std::int64_t> wanted_;
  std::map<std::int64_t, std::vector<EventRecord>> pages_;  // key: number before the first event
};

// `RecentEvents` has the newest events whole, of earlier events the number and the device, and of
// still earlier events the newest number of each device. No lock: EventFeed provides it.
//
//   number  1 … 60             61 … 80          81 … 90
//           newest per device  only the device  whole event

struct GoneEvent {
  std::int64_t seq = 0;
  std::string device{};
};

struct FeedLimits {
  std::size_t events = 4000;       ///< the newest events, whole: about 1 MB
  std::size_t remembered = 16000;  ///< older events of which only the device is in memory: 256 kB
};

/// FeedImage contains what the feed takes over from events.db. The lists are sorted by number.
struct FeedImage {
  std::int64_t newest = 0;
  std::vector<EventRecord> events{};
  std::vector<Alarm> alarms{};
  std::vector<GoneEvent> gone{};
  std::map<std::string, std::int64_t> older{};
};

class RecentEvents {
 public:
  explicit RecentEvents(FeedLimits limits) : limits_(limits) {}

  void Begin(FeedImage image);
  /// `events` must contain at least one event, and be sorted by number.
  void Add(std::vector<EventRecord> events);

  bool empty() const { return events_.empty(); }
  /// The number of the newest event of all devices; 0: there is no event.
  std::int64_t newest() const { return newest_; }
  std::int64_t oldest() const { return events_.front().seq; }

  /// Returns the event number whose low 32 bits are `number` and that is nearest to the newest
  /// number.
  std::int64_t Whole(std::uint32_t number) const;
  /// Returns the newest events, at most `most`, sorted by number. `device` null: events of all
  /// devices.
  std::vector<EventRecord> Newest(const std::string* device, std::size_t most) const;
  std::vector<EventRecord> From(std::int64_t first, const std::string* device,
                                std::size_t most) const;
  /// Returns how many events from `first` on are no longer in memory. Events so old that their
  /// device is not known are included, unless it is known that `device` had none from `first` on.
  std::uint64_t Lost(std::int64_t first, const std::string* device) const;
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
  /// `wake` is called on the thread that fills the feed, and must return at once.
  Listener Listen(std::function<void()> wake) {
    const MutexLock lock(mutex_);
    listeners_.emplace(next_, std::move(wake));
    return next_++;
  }
  /// When Leave has returned, `wake` of the listener is not called any more.
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

struct FedEvent {
  /// Number of the device; kGateway: no device, or a device that is no longer configured.
  Source source = kGateway;
  EventRecord record{};
};

class EventFeed {
 public:
  explicit EventFeed(FeedLimits limits = {}) : recent_(limits) {}

  /// Sets the contents of the opened file. Does nothing if the feed already contains events,
  /// because the file was then opened again.
  void Begin(FeedImage image);
  void Add(std::vector<EventRecord> events);
  /// Sets the numbers of the devices. Before the first call no device has a number.
  void Renumber(const SourceNames& sources);
  /// Returns the listeners, which are woken after Begin, Add and Supply.
  FeedListeners& listeners() { return listeners_; }

  struct Page {
    std::int64_t newest = 0;
    std::int64_t oldest = 0;  ///< number of the oldest event in memory, of all devices
    std::uint64_t lost = 0;
    std::vector<EventRecord> events{};  ///< at most `most`, sorted by number
  };
  /// Returns events of one device or of all, from number `first` on (low 32 bits of the number); 0:
  /// the newest. Events so old that their device is not known count as lost, unless it is known
  /// that the device had none from `first` on.
  Page Show(std::optional<Source> source, std::uint32_t first, std::size_t most) const;

  /// Returns events of all devices after number `after`. Returns none if they must first be read
  /// from the file; the listeners are woken when the events are in memory.
  std::vector<FedEvent> Take(std::int64_t after, std::size_t most);
  std::int64_t newest() const;

  /// The alarms. They are updated before the listeners are woken.
  const AlarmBoard& alarms() const { return alarms_; }

  /// Only the writing thread calls the functions below. `asked` is called on any thread when events
  /// have to be read from the file. Null: the file is not read. When ServeWith has returned, the
  /// previous function is not called any more.
  void ServeWith(std::function<void()> asked);
  /// Returns the smallest `after` for which Take waits for events from the file; they are passed to
  /// Supply with this number. Empty: Take waits for no events.
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
