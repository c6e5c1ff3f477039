// Whether the port of a line may be passed on over the network, and to whom. Structs come from
// config/port_server; what is wrong goes to Problems.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "config/model/line.h"
#include "config/model/mark.h"
#include "config/model/port_server.h"
#include "config/model/problem.h"

namespace baudgate::config {

/// Reports clients beyond loopback: an error without `allow`, a warning with it. `key`:
/// "serial_server" or "lend".
void CheckPortServer(const PortServer& server, const std::string& key, Problems& problems);
/// Reports keys of the line that cannot stand together. `keys`: all keys of the line.
void CheckPortServers(const Line& line, const Keys& keys, Problems& problems);

}  // namespace baudgate::config
