// Files that are written whole or not at all, whenever the power fails.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string_view>

namespace baudgate {

/// By way of FILE.part, for owner and group. The error is errno's; 0: it is on the disk.
int WriteWhole(const std::filesystem::path& file, std::string_view text);

}  // namespace baudgate
