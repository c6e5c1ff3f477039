// A status as one frame of `status --watch`: what is worst comes first, and it fits the terminal.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "gateway/tools/terminal/live_table.h"

namespace baudgate {

/// Head, lines, devices, sentences. Of what does not fit the view each part says how much it leaves
/// out. Throws a nlohmann exception where a field is missing: the gateway is of another version.
std::string RenderStatusFrame(const nlohmann::ordered_json& status, const TableView& view);

/// `all` lines for parts that want so many: a part that wants less than its share gets what it
/// wants, the others share the rest.
std::vector<std::size_t> Shares(std::size_t all, const std::vector<std::size_t>& wanted);

}  // namespace baudgate
