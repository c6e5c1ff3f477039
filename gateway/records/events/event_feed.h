// The newest events that are on the disk, for outputs that must never wait for it: Modbus looks at
// them (gateway/outputs/modbus/service), DDS takes them in order (gateway/outputs/dds). Filled by
// the writing thread of gateway/records/events/round_writer.h after each commit, never before. A
// consumer that takes all of them has a cursor (cursors.h); events that are no longer in memory it
// gets from the file, by way of that thread. A consumer that only looks misses these, and can count
// them by their numbers. Events have the names of their devices; the number of a device is looked
// up when it is asked for.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/guarded.h"
#include "gateway/records/events/alarm_board.h"
#include "gateway/records/events/backlog.h"
#include "gateway/records/events/event_record.h"
#include "gateway/records/events/feed_listeners.h"
#include "gateway/records/events/recent_events.h"
#include "gateway/records/events/source_numbers.h"

namespace baudgate::events {

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
