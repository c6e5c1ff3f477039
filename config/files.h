// Functions that read keys with paths of files: ReadAbsolutePath reads one path; ReadServerTls,
// ReadMutualTls and ReadClientTls read the files of TLS.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "config/model/network.h"
#include "config/yaml/yaml_reader.h"

namespace baudgate::config {

/// Returns the path in `key`. Empty: the key is missing, which is no error, or its value is not an
/// absolute path, which is reported as an error. `example`: an absolute path for the message.
std::string ReadAbsolutePath(MapReader& map, const std::string& key, const std::string& example);

/// Reads the optional TLS of a server: `certificate`, which needs `key`, and `client_ca`, which may
/// be missing. Without `certificate` there is no TLS, and the other keys are errors. `folder`: the
/// folder below /etc/baudgate in the examples of messages.
TlsFiles ReadServerTls(MapReader& map, const std::string& folder);

/// Reads `certificate`, `key` and `ca` of a Modbus listener. `on`: the listener has `protocol:
/// tls`, so the three keys are required. Otherwise these keys, and `roles`, are errors.
TlsFiles ReadMutualTls(MapReader& map, bool on);

/// Reads `ca`, `certificate` and `key` for a server that the gateway calls. `on`: its address
/// begins with `scheme`, so `ca` is required; otherwise the keys are errors.
TlsFiles ReadClientTls(MapReader& map, bool on, const std::string& folder,
                       std::string_view scheme = kTlsScheme);

}  // namespace baudgate::config
