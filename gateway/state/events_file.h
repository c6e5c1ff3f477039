// events.db in the state folder: the file of what has to be known for ever, audit and events alike.
// Every commit is on the disk before it returns (WAL, synchronous=FULL). docs/audit.md and
// docs/events.md have its tables.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "gateway/state/database.h"

namespace baudgate {

/// Written into the file, so that it is not taken for another program's: "BGev".
inline constexpr std::int64_t kEventsApplication = 0x42476576;
/// Of the tables; one more for each change of them.
inline constexpr std::int64_t kEventsVersion = 3;

struct OpenedEvents {
  std::unique_ptr<Database> database;  ///< null: `error` says why, and nothing was changed
  std::string error{};
  /// One line for the log: a damaged file was put aside and a new one begun; empty: it was not.
  std::string put_aside{};
};

/// Checks the file, brings its tables up to date, makes it where it is not there. One that is
/// damaged is renamed to events.db.bad, or .bad2 and so on; one of a newer version is not touched.
/// Takes as long as reading the whole file does.
/// `put_aside`: whatever it is, because it was found damaged while it was in use.
OpenedEvents OpenEvents(const std::filesystem::path& file, const std::string& vfs = {},
                        bool put_aside = false);

}  // namespace baudgate
