// The newest events that are on the disk, for outputs that must never wait for it: Modbus looks at
// them (gateway/outputs/modbus/service), DDS takes them in order (gateway/outputs/dds). Filled by
// the writing thread of gateway/records/events/event_log.h after each commit, never before. A
// consumer that takes all of them has a cursor; events that are no longer in memory
// it gets from the file, by way of that thread. A consumer that only looks misses these, and can
// count them by their numbers. Events have the names of their devices; the number of a device is
// looked up when it is asked for. Backlog, RecentEvents and FeedListeners are parts of EventFeed.
// CursorBook keeps the cursors.
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

// The position of each consumer of all events, by its name, kept in the file: after a restart it
// goes on where it was. From any thread.

/// The gateway's own consumers. The names stand in the file.
inline constexpr char kDdsConsumer[] = "dds";

struct Cursor {
  std::int64_t seq = 0;  ///< it has got this event, and all before
  /// It has confirmed them. Else the last ones may have been lost on their way when the gateway was
  /// killed.
  bool sure = false;

  bool operator==(const Cursor&) const = default;
};

using Cursors = std::map<std::string, Cursor>;

class CursorBook {
 public:
  /// The consumers. A cursor in the file of any other name is dropped.
  explicit CursorBook(std::set<std::string> consumers = {}) : consumers_(std::move(consumers)) {}

  /// Empty: it never got an event, or is no consumer.
  std::optional<Cursor> Of(const std::string& consumer) const;
  /// On the disk within a second or so. True: there is a change for the file now, and there was
  /// none before.
  bool Set(const std::string& consumer, Cursor cursor);

  // The rest is for the thread that writes the file.

  /// `due` is called on any thread when there is a change for the file. Null: nobody writes it;
  /// when this returns, the one before is not called any more.
  void OnDue(std::function<void()> due);
  /// What the file holds. What is known here takes precedence.
  void OnOpened(const Cursors& kept);
  /// All cursors, if the file differs; it is to hold no others.
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

// Events that a consumer still needs but that are no longer in memory. It asks by the last number
// that it has; the thread that writes the file reads them; the consumer takes them here. No lock,
// no disk.
//
//   Take(40)               → nothing: wanted() is 40
//   Supply(40, {41 … 600})
//   Take(40, 100)          → {41 … 140}, and so on with Take(140)
//
class Backlog {
 public:
  /// A page that its consumer does not take is not kept for ever.
  static constexpr std::size_t kMostPages = 8;

  /// nullopt: it is requested now. An empty list: the file has no event after `after` either.
  std::optional<std::vector<EventRecord>> Take(std::int64_t after, std::size_t most);
  std::optional<std::int64_t> wanted() const;
  void Supply(std::int64_t after, std::vector<EventRecord> events);

 private:
  std::set<std::int64_t> wanted_;
  std::map<std::int64_t, std::vector<EventRecord>> pages_;  // by the number before them
};

// The newest events in memory, the devices of those before them, and which events of a device
// cannot be shown any more. No lock: EventFeed has it.
//
//   number  1 … 60   61 … 80          81 … 90
//           old      only the device  whole

/// The device of an event that is no longer shown.
struct GoneEvent {
  std::int64_t seq = 0;
  std::string device{};
};

struct FeedLimits {
  std::size_t events = 4000;       ///< about 1 MB
  std::size_t remembered = 16000;  ///< devices of the events before these: 256 kB
};

/// The contents of a file when it is opened, in order of their numbers.
struct FeedImage {
  std::int64_t newest = 0;
  std::vector<EventRecord> events{};
  std::vector<Alarm> alarms{};
  std::vector<GoneEvent> gone{};
  std::map<std::string, std::int64_t> older{};  ///< the newest of each device before these
};

class RecentEvents {
 public:
  explicit RecentEvents(FeedLimits limits) : limits_(limits) {}

  /// When there are none.
  void Begin(FeedImage image);
  /// At least one, in order of their numbers.
  void Add(std::vector<EventRecord> events);

  bool empty() const { return events_.empty(); }
  std::int64_t newest() const { return newest_; }  ///< of all devices; 0: none
  std::int64_t oldest() const { return events_.front().seq; }

  /// The number with these low bits that is nearest to what there is.
  std::int64_t Whole(std::uint32_t number) const;
  /// `device`: null: of all. At most `most`, by their numbers.
  std::vector<EventRecord> Newest(const std::string* device, std::size_t most) const;
  std::vector<EventRecord> From(std::int64_t first, const std::string* device,
                                std::size_t most) const;
  /// From `first` on, before those that are shown. Events so old that their device is not known
  /// count, unless the device had none then.
  std::uint64_t Lost(std::int64_t first, const std::string* device) const;
  /// The event after this one is not here any more.
  bool HasLeft(std::int64_t after) const { return !empty() && after + 1 < oldest(); }

 private:
  struct Gone {
    std::int64_t seq = 0;
    const std::string* device = nullptr;  // in gone_devices_
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

// Outputs that are woken when a feed has more for them. From any thread.
class FeedListeners {
 public:
  using Listener = std::uint64_t;
  /// `wake` is called on the thread that fills the feed; it returns at once.
  Listener Listen(std::function<void()> wake) {
    const MutexLock lock(mutex_);
    listeners_.emplace(next_, std::move(wake));
    return next_++;
  }
  /// When this returns, it is not called any more.
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

/// An event with the number that its device has when the event is taken.
struct FedEvent {
  Source source = kGateway;  ///< also if the device is no longer configured
  EventRecord record{};
};

class EventFeed {
 public:
  explicit EventFeed(FeedLimits limits = {}) : recent_(limits) {}

  /// Does nothing if there are events already: the file was opened again.
  void Begin(FeedImage image);
  /// These events are on the disk, in order of their numbers.
  void Add(std::vector<EventRecord> events);
  /// The sources have these numbers from now on. Before the first call no device has one.
  void Renumber(const SourceNames& sources);
  /// They are woken after Begin, Add and Supply.
  FeedListeners& listeners() { return listeners_; }

  struct Page {
    std::int64_t newest = 0;  ///< of all devices; 0: none
    std::int64_t oldest = 0;  ///< that can be shown, of all devices
    std::uint64_t lost = 0;   ///< events of `source` after the first asked for that cannot be shown
    std::vector<EventRecord> events{};  ///< at most `most`, by their numbers
  };
  /// Events of one device or of all, from this number on (its low 32 bits); 0: the newest. Events
  /// so old that their device is not known count as lost, unless the device had none then.
  Page Show(std::optional<Source> source, std::uint32_t first, std::size_t most) const;

  /// Events of all devices after `after`, at most `most`. Also none if they must be read from the
  /// file first: listeners are woken when they are there.
  std::vector<FedEvent> Take(std::int64_t after, std::size_t most);
  std::int64_t newest() const;

  /// The new states of alarms; called before the listeners are woken.
  const AlarmBoard& alarms() const { return alarms_; }

  /// The rest is for the thread that writes the file. `asked` is called on any thread when events
  /// are to be read. Null: the file is not read; when this returns, the one before is not called
  /// any more.
  void ServeWith(std::function<void()> asked);
  /// The number after which events are to be read; empty: none are.
  std::optional<std::int64_t> wanted() const;
  void Supply(std::int64_t after, std::vector<EventRecord> events);

 private:
  FedEvent Numbered(EventRecord record) const BAUDGATE_REQUIRES(mutex_);
  bool IsServed() const;

  mutable Mutex mutex_;
  RecentEvents recent_ BAUDGATE_GUARDED_BY(mutex_);
  std::map<std::string, Source> numbers_ BAUDGATE_GUARDED_BY(mutex_);  // of devices
  Backlog backlog_ BAUDGATE_GUARDED_BY(mutex_);
  AlarmBoard alarms_;
  mutable Mutex asking_;
  std::function<void()> asked_ BAUDGATE_GUARDED_BY(asking_);
  FeedListeners listeners_;
};

}  // namespace baudgate::events
