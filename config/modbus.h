// `ReadRoute` reads one entry of modbus.routes: which unit ids go to which line or server.
// ReadListener reads one entry of modbus.listen.
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

/// Reads a route. `lines` are the possible targets. A route to a server that is one of `listeners`
/// is an error.
Route ReadRoute(const YamlNode& node, const std::vector<Listener>& listeners,
                const std::vector<Line>& lines, LoadContext& context);

/// Reads a listener, which is an address ("0.0.0.0:502", "/dev/ttyS1") or a map.
Listener ReadListener(const YamlNode& node, LoadContext& context);
/// Reads a list with at least one network or address, as the key `allow` has it.
std::vector<Network> ReadAllow(const YamlNode& node, const std::string& key, Problems& problems);
/// Like ReadAllow, but `[]` is like an absent key.
std::vector<Network> ReadNetworks(const YamlNode& node, const std::string& key, Problems& problems);
/// Reads an address of this machine: "127.0.0.1:4001", "localhost:4001".
std::optional<HostPort> ReadOwnAddress(const YamlNode& node, const std::string& key,
                                       const std::string& example, Problems& problems);

}  // namespace baudgate::config
