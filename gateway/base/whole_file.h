// Files that are read whole, and written whole or not at all, whenever the power fails.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace baudgate {

/// By way of FILE.part, for owner and group. The error is errno's; 0: it is on the disk.
int WriteWhole(const std::filesystem::path& file, std::string_view text);

/// In the place of `to`, which lies in the same folder. The error is errno's; 0: it is on the disk.
int MoveFile(const std::filesystem::path& from, const std::filesystem::path& to);

/// If it is there. The error is errno's; 0: it is gone from the disk.
int RemoveFile(const std::filesystem::path& file);

/// `any`: pipes as well, which wait for a writer.
enum class Kind : std::uint8_t { regular, any };

/// Empty: it is not there, cannot be read, is larger, or is of another kind; errno says which.
std::optional<std::string> ReadWhole(const std::filesystem::path& file, Kind kind = Kind::regular);

}  // namespace baudgate
