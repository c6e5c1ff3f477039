// events.db in the state folder: the file of what has to be known for ever, audit and events alike.
// Every commit is on the disk before it returns (WAL, synchronous=FULL). docs/audit.md and
// docs/events.md have its tables.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "gateway/records/disk/database_file.h"

namespace baudgate {

/// Written into the file, so that it is not taken for another program's: "BGev".
inline constexpr std::int64_t kEventsApplication = 0x42476576;
/// The version of the tables; one more for each change of them.
inline constexpr std::int64_t kEventsVersion = 1;

using OpenedEvents = OpenedDatabase;

/// As OpenDatabase.
OpenedEvents OpenEvents(const std::filesystem::path& file, const std::string& vfs = {},
                        const std::string& damage = {});

}  // namespace baudgate
