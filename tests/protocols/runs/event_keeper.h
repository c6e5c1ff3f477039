// EventKeeper stores events in a run in virtual time. It uses book and file as
// gateway/records/events/event_log.cpp does, on a disk whose power can fail.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "gateway/bus/devices/poller_listener.h"
#include "gateway/records/events/event_feed.h"
#include "gateway/records/events/event_file.h"
#include "gateway/records/events/event_source.h"
#include "gateway/records/events/record_table.h"
#include "tests/gateway/records/audit/faulty_disk.h"

namespace baudgate::protocols {

class EventKeeper {
 public:
  explicit EventKeeper(const std::vector<std::string>& devices);

  void Begin(int power_left);
  /// Call this when the program is killed. After a power cut, all unsynced data are lost.
  void End(std::mt19937& random);

  bool Keep(const bus::ReportedEvents& reported, const config::Device& device);
  std::vector<events::OwedRecord> TakeOwed() { return std::exchange(owed_, {}); }
  bool Keep(const events::KeptRecord& record);
  /// From now on until End, the feed gets the stored events, and its cursors are stored.
  void SetFeed(std::shared_ptr<events::EventFeed> feed,
               std::shared_ptr<events::CursorBook> cursors);
  bool Serve();

  std::string Said(std::uint32_t device) const;
  bool power_failed() const { return disk_.power_failed(); }
  std::uint64_t repeats() const { return book_->repeats(); }

  std::vector<events::EventRecord> ReadAll();
  std::vector<events::KeptRecord> ReadRecords();

  std::size_t asked_again = 0;

 private:
  bool Open();
  bool Write();

  audit::FaultyDisk disk_;
  events::SourceNames names_;
  std::unique_ptr<events::EventBook> book_;
  std::unique_ptr<events::EventFile> file_;
  std::shared_ptr<events::EventFeed> feed_;
  std::shared_ptr<events::CursorBook> cursors_;
  events::Said said_;
  std::vector<events::OwedRecord> owed_;
  // Devices with a batch that is in `book_`, but not in the file yet.
  std::set<std::uint32_t> waiting_;
};

}  // namespace baudgate::protocols
