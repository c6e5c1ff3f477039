// Reads whole files, and writes files either completely or not at all, even if the power fails.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace baudgate {

/// Writes FILE.part and renames it to `file`, readable for owner and group (0640, whatever the
/// umask). A file that exists keeps its owner and group. Returns an errno; 0:
/// the file is written and synced. A failed sync of the folder is ignored.
int WriteWhole(const std::filesystem::path& file, std::string_view text);

/// Renames `from` to `to`, which must be in the same folder, and replaces `to`. Returns an errno;
/// 0: `to` is replaced. A failed sync of the folder is ignored.
int MoveFile(const std::filesystem::path& from, const std::filesystem::path& to);

/// Removes the file if it exists. Returns an errno; 0: there is no such file any more.
int RemoveFile(const std::filesystem::path& file);

/// Kinds of files that ReadWhole accepts. With `any`, pipes are accepted, and ReadWhole waits for
/// their writer.
enum class Kind : std::uint8_t { regular, any };

/// Returns the content; nothing, with errno set, if the file does not exist, cannot be read, has
/// more than 32 MiB, or is not of this `kind`.
std::optional<std::string> ReadWhole(const std::filesystem::path& file, Kind kind = Kind::regular);

}  // namespace baudgate
