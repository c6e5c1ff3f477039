// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace baudgate::control {

/// What to do with damaged databases, by name, in this folder; empty: there are none.
std::string PutAsideAdvice(const std::filesystem::path& folder,
                           const std::vector<std::string>& files);

}  // namespace baudgate::control
