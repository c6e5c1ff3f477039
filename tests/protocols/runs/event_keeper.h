// EventKeeper is the store of events in a run in virtual time: it uses book and file as
// gateway/records/events/event_log.cpp does, on a disk whose power may fail.
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
  /// `devices`: the names of the devices of the line "line", by their numbers.
  explicit EventKeeper(const std::vector<std::string>& devices);

  /// The program starts. `power_left`: disk writes until the power fails; -1: never.
  void Begin(int power_left);
  /// The program was killed. If the power failed, all unsynced data of the disk is lost.
  void End(std::mt19937& random);

  /// False: not stored yet, report again.
  bool Keep(const bus::ReportedEvents& reported, const config::Device& device);
  /// Returns and clears the records that have been outstanding since Begin.
  std::vector<events::OwedRecord> TakeOwed() { return std::exchange(owed_, {}); }
  bool Keep(const events::KeptRecord& record);
  /// Valid between Begin and End: the feed gets the stored events, and its cursors are stored.
  void SetFeed(std::shared_ptr<events::EventFeed> feed,
               std::shared_ptr<events::CursorBook> cursors);
  /// Executes the requests of the feed. False: the disk fails.
  bool Serve();

  /// The last state of the device in the file at Begin.
  std::string Said(std::uint32_t device) const;
  bool power_failed() const { return disk_.power_failed(); }
  std::uint64_t repeats() const { return book_->repeats(); }

  /// Reads all events; the test fails if there is a gap.
  std::vector<events::EventRecord> ReadAll();
  std::vector<events::KeptRecord> ReadRecords();

  std::size_t asked_again = 0;  ///< batches that were reported again

 private:
  bool Open();
  bool Write();

  audit::FaultyDisk disk_;
  events::SourceNames names_;
  std::unique_ptr<events::EventBook> book_;
  std::unique_ptr<events::EventFile> file_;
  std::shared_ptr<events::EventFeed> feed_;  // null: no consumer
  std::shared_ptr<events::CursorBook> cursors_;
  events::Said said_;
  std::vector<events::OwedRecord> owed_;
  std::set<std::uint32_t> waiting_;  // devices whose batch is in the book
};

}  // namespace baudgate::protocols
