// What `baudgate check` says of all that the gateway keeps: events, readings of meters, the
// history.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <ostream>

#include "config/model/config.h"

namespace baudgate {

/// Nothing where nothing is kept, as all of these.
void PrintEvents(const config::Config& config, std::ostream& out);
void PrintOfMeters(const config::Config& config, std::ostream& out);
void PrintHistory(const config::Config& config, std::ostream& out);
nlohmann::ordered_json HistoryJson(const config::Config& config);

}  // namespace baudgate
