// Files that have no part of the status of their own: how many are open, and which small ones
// cannot be written.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace baudgate::control {

struct FilesState {
  std::size_t open = 0;   ///< of this process
  std::size_t limit = 0;  ///< 0: there is none
  std::vector<std::string> troubles{};
};

nlohmann::ordered_json FilesJson(const FilesState& state);

/// What to do with damaged databases, by name, in this folder; empty: there are none.
std::string PutAsideAdvice(const std::filesystem::path& folder,
                           const std::vector<std::string>& files);

}  // namespace baudgate::control
