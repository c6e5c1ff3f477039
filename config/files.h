// Functions that read keys with paths of files: ReadAbsolutePath reads one path; ReadServerTls,
// ReadMutualTls and ReadClientTls read the files of TLS.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "config/model/network.h"
#include "config/yaml/yaml_reader.h"

namespace baudgate::config {

/// Returns the path; empty: the key is missing, or its path is not absolute, which is an error.
std::string ReadAbsolutePath(MapReader& map, const std::string& key, const std::string& example);

/// Reads `certificate`, `key` and `client_ca` of a server whose TLS is optional. `folder`: the
/// folder below /etc/baudgate in the examples of messages.
TlsFiles ReadServerTls(MapReader& map, const std::string& folder);

/// Reads `certificate`, `key` and `ca` of a server with `protocol: tls`, which needs all three.
/// `on` is false: the keys are errors.
TlsFiles ReadMutualTls(MapReader& map, bool on);

/// Reads `ca`, `certificate` and `key` for a server that the gateway calls. `on`: its address
/// begins with tls://, so `ca` is required; otherwise the keys are errors.
TlsFiles ReadClientTls(MapReader& map, bool on);

}  // namespace baudgate::config
