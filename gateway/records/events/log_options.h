// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gateway/records/disk/events_writer.h"
#include "gateway/records/events/cursors.h"
#include "gateway/records/events/event_feed.h"
#include "gateway/records/events/event_table.h"
#include "gateway/records/events/watched.h"

namespace baudgate::events {

struct LogOptions {
  std::filesystem::path file;  ///< empty: there is no place for it
  std::string why_no_file{};
  /// There is no file: events are known until the program ends.
  bool in_memory = false;
  std::string vfs{};  ///< as in Database
  /// Shared with the audit. Null: EventLog makes one.
  std::shared_ptr<EventsWriter> writer{};
  SourceNames sources;
  std::function<Now()> clocks;
  std::shared_ptr<EventFeed> feed{};  ///< gets what is on the disk; null: there is none
  /// The positions of consumers, kept in the file. Null: there are none.
  std::shared_ptr<CursorBook> cursors{};
  bool tells_own = false;  ///< the gateway's own events are kept, too
  Watched watches{};
  /// The last batches of these sources are on the disk, so the sources may be asked for more.
  /// Called on the writing thread.
  std::function<void(const std::vector<Source>& sources)> kept;
  /// The events of these records are on the disk, and the records are still to be read. Called on
  /// the writing thread: when the file first opens, and after a commit, before `kept`. Empty:
  /// records are not read.
  std::function<void(const std::vector<OwedRecord>& owed)> owed{};
  /// An alarm has changed, or was `raised`. Each change is reported once, also while the disk
  /// fails. Called on the writing thread, or from Watch. Empty: not wanted.
  std::function<void(const Alarm& alarm, bool raised)> alarm{};
  /// One line when the disk begins to fail, and one when it is well again; from any thread.
  std::function<void(const std::string&)> warn;
  std::function<void(const std::string&)> inform;
};

}  // namespace baudgate::events
