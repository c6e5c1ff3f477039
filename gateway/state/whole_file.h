// Files that are read whole, and written whole or not at all, whenever the power fails.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace baudgate {

/// By way of FILE.part, for owner and group. The error is errno's; 0: it is on the disk.
int WriteWhole(const std::filesystem::path& file, std::string_view text);

/// Nothing: it is not there, or can not be read, or is no file; errno says which.
std::optional<std::string> ReadWhole(const std::filesystem::path& file);

}  // namespace baudgate
