// The answer to a status request (gateway/outputs/status/status_json.h) as text for people.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "gateway/tools/terminal/live_table.h"

namespace baudgate {

/// `target` as in the request: nothing, a line, or a device. Throws a nlohmann exception where a
/// field is missing: the gateway is of another version.
std::string RenderStatus(const nlohmann::ordered_json& status, const std::string& target,
                         const TableView& view);

}  // namespace baudgate
