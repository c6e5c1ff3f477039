// A device's `ratios`: what its units are at this site, applied to every point that has them.
//
//   ratios: { xIn: 400 A, xUn: 10 kV }      current_l1, unit xIn, reads 0.52 → 208 A
//
// YAML comes from the device; scale, offset and unit of its points change.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/model/device.h"
#include "config/yaml/yaml_reader.h"

namespace baudgate::config {

/// `device.points` are complete. A unit that no point has is a problem, and so is a ratio that is
/// not above 0 or that a point cannot take.
void ApplyRatios(MapReader& map, Device& device);

}  // namespace baudgate::config
