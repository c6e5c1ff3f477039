// The sections gateway, modbus, dds and web: the gateway's name, whom it serves, and where it
// passes Modbus requests on. YAML nodes come from config/loader; structs go to config::Config.
// ReadDdsPeers, ReadDdsSecurity and ReadWeb read sections of their own.
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

// Who is asked beside the multicast group, or in its place: `dds: { peers, discovery_servers,
// multicast }`.

/// After `interfaces`, which must reach what stands here.
void ReadDdsPeers(MapReader& map, Dds& dds, Problems& problems);

// `dds: { security: … }`: a folder, or the files one by one.

/// Paths come out absolute. The files are not looked at: what is wrong with them is a state of the
/// gateway, and for `baudgate check` to say.
DdsSecurity ReadDdsSecurity(const YamlNode& node, LoadContext& context);

// The key web: the page for browsers, JSON for programs, metrics for Prometheus.
//
//   web:
//     listen: 127.0.0.1:8502
//     allow: [10.0.0.0/8]
//     hosts: [gate.example.com]
//     token: { file: /etc/baudgate/web.token }
//     acknowledge: allow

/// A server that listens beyond loopback without a token is a problem.
Web ReadWeb(const YamlNode& node, Problems& problems);

/// The daemon has no working directory of its own choosing. Empty when the key is absent or wrong.
std::string ReadAbsolutePath(MapReader& map, const std::string& key, const std::string& example);
/// Name, recordings and socket go to `config`; returned is what the section says for all lines.
Pace ReadGateway(const YamlNode& node, Config& config, Problems& problems);
/// After the lines: routes lead to them, and no port serves two masters.
Modbus ReadModbus(const YamlNode& node, const std::vector<Line>& lines, LoadContext& context);
/// What applies where there is no `modbus:` at all: loopback, port 1502.
Modbus DefaultModbus();
Dds ReadDds(const YamlNode& node, LoadContext& context);

}  // namespace baudgate::config
