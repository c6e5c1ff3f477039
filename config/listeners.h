// One entry of modbus.listen: which clients may ask there, in which protocol, and for what.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "config/lines.h"
#include "config/model/listener.h"
#include "config/yaml/yaml_reader.h"

namespace baudgate::config {

/// A place alone ("0.0.0.0:502", "/dev/ttyS1") or a map of keys.
Listener ReadListener(const YamlNode& node, LoadContext& context);
/// The networks and addresses that may connect; at least one.
std::vector<Network> ReadAllow(const YamlNode& node, Problems& problems);
/// The same, but `[]` lets everybody in, as if it were left out.
std::vector<Network> ReadAllowOrAll(const YamlNode& node, Problems& problems);
/// Where this machine listens: "127.0.0.1:4001", "localhost:4001".
std::optional<HostPort> ReadOwnAddress(const YamlNode& node, const std::string& key,
                                       const std::string& example, Problems& problems);

}  // namespace baudgate::config
