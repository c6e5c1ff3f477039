// The sections gateway, modbus and dds: who this gateway is and to whom it serves.
// YAML nodes come from config/loader; structs go to config::Config.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "config/config.h"
#include "config/validate.h"
#include "config/yaml_reader.h"

namespace baudgate::config {

/// Name, recordings and socket go to `config`; returned is what the section says for all lines.
Pace ReadGateway(const YamlNode& node, Config& config, Problems& problems);
Modbus ReadModbus(const YamlNode& node, Uniques& uniques, Problems& problems);
/// What applies where there is no `modbus:` at all: loopback, port 1502.
Modbus DefaultModbus();
Dds ReadDds(const YamlNode& node, Problems& problems);

}  // namespace baudgate::config
