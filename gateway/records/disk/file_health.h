// What can be told of a database from its bytes: whether it is a file at all, whether its head
// makes sense, and whether its write-ahead log has lost what was committed. Source:
// https://www.sqlite.org/fileformat.html, sections 1.3 and 4.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

#include "gateway/base/bytes.h"

namespace baudgate {

/// Why it must not be opened: the file, its log or its index is a FIFO, a folder or a device, which
/// might block for ever. Empty: all are regular files, or not there.
std::optional<std::string> WhyNoFile(const std::filesystem::path& file);

/// Why this process may not read a file that is there, and what helps. Empty: it may.
std::optional<std::string> WhyNoAccess(const std::filesystem::path& file);

/// What keeps this process from writing to a file that is there, and what helps.
std::string WhyReadOnly(const std::filesystem::path& file);

inline constexpr std::size_t kDatabaseHead = 100;

/// What is wrong with the first bytes of a database. SQLite itself calls some of it "readonly" or
/// "unsupported". Empty: they make sense.
std::optional<std::string> HeadDamage(View head);

/// SQLite reads the log up to the first frame that is damaged and says nothing of those behind it.
/// A last transaction that is torn is no loss: it was never committed. Empty: nothing is lost.
std::optional<std::string> LogDamage(const std::filesystem::path& file);

}  // namespace baudgate
