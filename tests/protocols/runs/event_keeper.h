// The store of events in a run under virtual time: book and file as
// gateway/records/events/event_log.cpp uses them, on a disk whose power may be cut.
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
  /// Devices of the line "line", by their numbers.
  explicit EventKeeper(const std::vector<std::string>& devices);

  /// The program starts. `power_left`: of the disk, from now on; -1: it does not fail.
  void Begin(int power_left);
  /// It was killed, and with the power all that the disk had not synced is gone.
  void End(std::mt19937& random);

  /// False: not yet.
  bool Keep(const bus::ReportedEvents& reported, const config::Device& device);
  /// What the file owes at Begin, or since this was called last.
  std::vector<events::OwedRecord> TakeOwed() { return std::exchange(owed_, {}); }
  bool Keep(const events::KeptRecord& record);
  /// Between Begin and End: hears of what is on the disk, and has its cursors kept.
  void SetFeed(std::shared_ptr<events::EventFeed> feed,
               std::shared_ptr<events::CursorBook> cursors);
  /// What the feed asks for is done. False: the disk fails.
  bool Serve();

  /// What the file held at Begin of what the device has said last.
  std::string Said(std::uint32_t device) const;
  bool power_failed() const { return disk_.power_failed(); }
  std::uint64_t repeats() const { return book_->repeats(); }

  /// Without a gap, or the test fails.
  std::vector<events::EventRecord> ReadAll();
  std::vector<events::KeptRecord> ReadRecords();

  std::size_t asked_again = 0;  ///< batches that came once more

 private:
  bool Open();
  bool Write();

  audit::FaultyDisk disk_;
  events::SourceNames names_;
  std::unique_ptr<events::EventBook> book_;
  std::unique_ptr<events::EventFile> file_;
  std::shared_ptr<events::EventFeed> feed_;  // null: nobody hears
  std::shared_ptr<events::CursorBook> cursors_;
  events::Said said_;
  std::vector<events::OwedRecord> owed_;
  std::set<std::uint32_t> waiting_;  // devices whose batch is in the book
};

}  // namespace baudgate::protocols
