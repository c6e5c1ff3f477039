// The key history: which values are kept.
//
//   history:
//     points:
//       - "bay-1.*.current_*"                       LINE.DEVICE.POINT, each with * and ?
//       - { match: "io.ai-1.*", deadband: 0.5 }     of several that match the first counts
//       - { match: "*.*.serial", log: off }         changes, if it is not said; all; off
//     max_gap: 10min                                also at one of the points
//     directory: /data/baudgate
//     limit: 1GB
//     keep: 365d
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "config/model/config.h"
#include "config/yaml/yaml_reader.h"

namespace baudgate::config {

/// After the lines, whose points it names.
History ReadHistory(const YamlNode& node, const Config& config, Problems& problems);

}  // namespace baudgate::config
