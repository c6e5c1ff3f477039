// What meters have measured and kept themselves, for `baudgate history`:
// LINE.DEVICE.load_1.active_import.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "gateway/records/events/past_page.h"

namespace baudgate::control {

/// Four parts: of the past, as points have three. With line, device and name; empty: three or
/// fewer.
std::optional<events::PastQuery> PastQueryOf(const std::string& text);

/// {"records":[…],"next":[4711,1790000000000000],"more":false}; a record as `baudgate history
/// --json` prints it, with "seconds", of how long it is.
nlohmann::ordered_json PageJson(const events::PastPage& page, const std::string& point);

}  // namespace baudgate::control
