// Reads the keys of points and devices that become config::Writing. Interlocks name points of any
// line, so ResolveInterlocks looks these points up when all lines have been read.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/model/config.h"
#include "config/yaml/yaml_reader.h"

namespace baudgate::config {

/// Reads min, max, step, decimals, select, select_time and allow_when of a point. The permission to
/// write is a key of the device (ApplyWritePermit).
Writing ReadWriting(MapReader& map);

/// Reads `write: allow`, `deny` or a list of points, and `allow_when`, for all points of the
/// device.
void ApplyWritePermit(MapReader& map, Device& device);

/// Finds the points that interlocks name, and converts their expected values to the points' types.
void ResolveInterlocks(Config& config, Problems& problems);

}  // namespace baudgate::config
