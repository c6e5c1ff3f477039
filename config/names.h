// What may be called how: the one rule for names of gateways, lines, devices and points.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "config/yaml_reader.h"
#include "gateway/base/result.h"

namespace baudgate::config {

/// Letters, digits and single '_' or '-' between them, at most 64 (the key length of the DDS
/// topics).
Status CheckName(std::string_view name);
/// Letters, digits and single '_' between them, no digit first: usable as an identifier everywhere.
Status CheckPointName(std::string_view name);

/// The `name` that a line or device must have, checked; messages call it so from now on.
std::optional<std::string> ReadName(MapReader& map, std::string_view example);

}  // namespace baudgate::config
