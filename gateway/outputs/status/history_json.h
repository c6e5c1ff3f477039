// The history in the answers of the control socket: how it is kept, and what it holds.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "gateway/records/history/history_source.h"

namespace baudgate::control {

/// {"state":"fine","since":…,"trouble":"","points":12,"readings":…,"advice":[…]}
nlohmann::ordered_json HistoryJson(const history::HistoryState& state);

/// {"records":[…],"next":[3,1790000000000],"more":false}; a record as `baudgate history --json`
/// prints it.
nlohmann::ordered_json PageJson(const history::Page& page, const std::string& point);
nlohmann::ordered_json PageJson(const history::TrendPage& page, const std::string& point);

}  // namespace baudgate::control
