// Which files of the state folder a newer baudgate has written: they are not for this one, which
// would read them wrong, or take for damaged what it does not know.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace baudgate {

/// The version of devices.json and clocks.json; a file that has none is the first.
inline constexpr std::int64_t kDevicesVersion = 1;

/// The latest version of the tables that this baudgate knows, by the file's application_id; 0: it
/// is no file of ours.
std::int64_t KnownVersion(std::int64_t application);

/// A sentence that names the first file of a newer one; empty: there is none. Nothing is written,
/// whatever is there.
std::string NewerStateIn(const std::filesystem::path& folder);

}  // namespace baudgate
