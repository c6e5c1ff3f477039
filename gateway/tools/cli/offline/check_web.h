// What `baudgate check` says of the web server.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <ostream>
#include <vector>

#include "config/model/config.h"
#include "config/model/problem.h"

namespace baudgate {

/// Adds what is wrong with the token file.
void CheckWebToken(const config::Config& config, std::vector<config::Problem>& problems);

/// "web 127.0.0.1:8502, …", and how many series of metrics there are.
void PrintWeb(const config::Config& config, std::ostream& out);

/// The same for `--json`; null: it is off.
nlohmann::ordered_json WebJson(const config::Config& config);

}  // namespace baudgate
