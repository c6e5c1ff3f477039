// The newest events in memory, the devices of those before them, and which events of a device
// cannot be shown any more. No lock: gateway/records/events/event_feed.h has it.
//
//   number  1 … 60   61 … 80          81 … 90
//           old      only the device  whole
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "gateway/records/events/alarm.h"
#include "gateway/records/events/event_record.h"

namespace baudgate::events {

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

}  // namespace baudgate::events
