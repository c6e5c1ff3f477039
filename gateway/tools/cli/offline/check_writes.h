// What `check` says of writes: which points may be written, and which could be if the device said
// so.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <ostream>

#include "config/model/line.h"

namespace baudgate {

///   writes to feeder-1: setting_group (1 to 2, selected first)
///   writes to feeder-2: none; 5 points could be written (setting_group, …): add 'write: allow', …
void PrintWrites(const config::Line& line, std::ostream& out);

/// {"allowed":["setting_group"],"off":[]}: names of points that could be written.
nlohmann::ordered_json WritesJson(const config::Device& device);

}  // namespace baudgate
