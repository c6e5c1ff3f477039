// The key `name` of lines and devices.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "config/yaml/yaml_reader.h"

namespace baudgate::config {

/// The `name` that a line or device must have, checked; messages call it so from now on.
std::optional<std::string> ReadName(MapReader& map, std::string_view example);

}  // namespace baudgate::config
