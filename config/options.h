// The keys of a line or device that its protocol declares. YAML nodes come from config/lines,
// config/devices and config/profile; values go to config::Options.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/model/options.h"
#include "config/yaml/yaml_reader.h"
#include "protocols/protocol.h"

namespace baudgate::config {

/// The options of that scope that stand in `map`. Those of the other scope are refused, and the
/// message says where they belong.
Options ReadOptions(MapReader& map, const Protocol& protocol, OptionSpec::Scope scope);

}  // namespace baudgate::config
