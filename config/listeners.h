// One entry of modbus.listen: who may ask there, in which protocol, and for what.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "config/lines.h"
#include "config/model/listener.h"
#include "config/yaml/yaml_reader.h"

namespace baudgate::config {

/// A place alone ("0.0.0.0:502", "/dev/ttyS1") or a map of keys.
Listener ReadListener(const YamlNode& node, LoadContext& context);
/// The networks and addresses that may connect; at least one.
std::vector<Network> ReadAllow(const YamlNode& node, Problems& problems);

}  // namespace baudgate::config
