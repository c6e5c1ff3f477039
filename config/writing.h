// What may be written: the keys of points and devices behind config::Writing. YAML comes from
// config/points and config/devices; interlocks find their points when all lines have been read.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/model/config.h"
#include "config/yaml/yaml_reader.h"

namespace baudgate::config {

/// min, max, step, decimals, select, select_time and allow_when of a point. What is allowed is the
/// device's affair.
Writing ReadWriting(MapReader& map);

/// `write: allow`, `deny` or a list of points, and `allow_when`, for all points of the device.
void ApplyWritePermit(MapReader& map, Device& device);

/// Finds the points that interlocks name, and turns what they have to be into their types.
void ResolveInterlocks(Config& config, Problems& problems);

}  // namespace baudgate::config
