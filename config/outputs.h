// The sections gateway, modbus, dds and web: the gateway's name, whom it serves, and where it
// passes Modbus requests on. YAML nodes come from config/loader; structs go to config::Config.
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

/// The daemon has no working directory of its own choosing. Empty when the key is absent or wrong.
std::string ReadAbsolutePath(MapReader& map, const std::string& key, const std::string& example);
/// Name, recordings and socket go to `config`; returned is what the section says for all lines.
Pace ReadGateway(const YamlNode& node, Config& config, Problems& problems);
/// After the lines: routes lead to them, and no port serves two masters.
Modbus ReadModbus(const YamlNode& node, const std::vector<Line>& lines, LoadContext& context);
/// What applies where there is no `modbus:` at all: loopback, port 1502.
Modbus DefaultModbus();
/// The sections of all other outputs, each if it is there.
void ReadOutputs(MapReader& map, Config& config, LoadContext& context);

}  // namespace baudgate::config
