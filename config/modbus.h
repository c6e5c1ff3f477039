// One entry of modbus.routes: which unit ids go to which line or server. ReadListener reads one
// entry of modbus.listen.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "config/lines.h"
#include "config/model/line.h"
#include "config/model/outputs.h"
#include "config/yaml/yaml_reader.h"

namespace baudgate::config {

/// `lines`: those that it may lead to. A server that is one of `listeners` would ask itself.
Route ReadRoute(const YamlNode& node, const std::vector<Listener>& listeners,
                const std::vector<Line>& lines, LoadContext& context);

// One entry of modbus.listen: which clients may ask there, in which protocol, and for what.

/// A place alone ("0.0.0.0:502", "/dev/ttyS1") or a map of keys.
Listener ReadListener(const YamlNode& node, LoadContext& context);
/// The networks and addresses that may connect. `[]` lets everybody in, as if it were left out.
std::vector<Network> ReadAllowOrAll(const YamlNode& node, Problems& problems);
/// Where this machine listens: "127.0.0.1:4001", "localhost:4001".
std::optional<HostPort> ReadOwnAddress(const YamlNode& node, const std::string& key,
                                       const std::string& example, Problems& problems);

}  // namespace baudgate::config
