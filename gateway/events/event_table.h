// The tables `events` and `event_sources` of events.db: batches in, in one transaction, and the
// oldest out. One thread; gateway/events/event_page.h reads from another connection.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "gateway/events/alarm_table.h"
#include "gateway/events/event_book.h"
#include "gateway/events/event_feed.h"
#include "gateway/events/past_table.h"
#include "gateway/state/database.h"

namespace baudgate::events {

/// Line and device of each source, by its number.
using SourceNames = std::vector<std::pair<std::string, std::string>>;

/// By its name alone, so that a device that has moved to another line keeps what it said there;
/// kGateway: none has it.
Source SourceOf(const SourceNames& names, std::string_view device);

/// So many are kept: about 200 MB.
inline constexpr std::int64_t kMostEvents = 1'000'000;

/// How the gateway that wrote to the file before has ended.
struct LastRun {
  enum class End : std::uint8_t { unknown, in_order, broken_off } end = End::unknown;
  WallTime last{};  ///< the last that it has written
};

class EventTable {
 public:
  /// `database` is of OpenEvents, and outlives it, as `names` does.
  EventTable(Database& database, const SourceNames& names, std::int64_t most = kMostEvents);

  struct Contents {
    bool ok = false;
    std::int64_t last = 0;
    std::map<Source, std::string> said{};
    LastRun last_run{};
    std::vector<Alarm> alarms{};
    FeedImage image{};
  };
  Contents Read(FeedLimits limits = {});
  /// All or none, and with them the alarms that they have changed.
  bool Write(const std::vector<Batch>& batches);
  /// These alarms and no others.
  bool WriteAlarms(const std::vector<Alarm>& alarms);

 private:
  bool ReadRun(Contents& contents);
  bool Insert(const Batch& batch);
  bool ReadImage(FeedLimits limits, FeedImage& image);

  Database& database_;
  const SourceNames& names_;
  const std::int64_t most_;
  Statement insert_;
  Statement said_;
  Statement drop_;
  AlarmTable alarms_;
  PastTable past_;
};

}  // namespace baudgate::events
