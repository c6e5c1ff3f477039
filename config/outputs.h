// Reads the sections gateway, modbus, dds, mqtt and web.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "config/lines.h"
#include "config/model/config.h"
#include "config/model/outputs.h"
#include "config/model/problem.h"
#include "config/yaml/yaml_reader.h"

namespace baudgate::config {

/// Reads the section into `config` and returns its settings for all lines.
Pace ReadGateway(const YamlNode& node, Config& config, Problems& problems);
/// Must be called after the lines were read, because routes lead to lines, and a port can have only
/// one user.
Modbus ReadModbus(const YamlNode& node, const std::vector<Line>& lines, LoadContext& context);
/// Returns the settings that apply without `modbus:`: loopback, port 1502.
Modbus DefaultModbus();
void ReadOutputs(MapReader& map, Config& config, LoadContext& context);

}  // namespace baudgate::config
