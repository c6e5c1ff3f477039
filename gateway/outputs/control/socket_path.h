// `SocketPaths` returns where the control socket of a gateway may be; gateway and client try the
// places in this order.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "gateway/base/result.h"

namespace baudgate::control {

/// /run/baudgate (made by systemd), $XDG_RUNTIME_DIR/baudgate, /tmp/baudgate-UID.
std::vector<std::string> SocketDirectories();

/// NAME.sock in each directory.
std::vector<std::string> SocketPaths(const std::string& gateway);

/// Makes `directory` if it is missing, except /run/baudgate. A directory that another user owns or
/// may write to is refused, because that user could impersonate the gateway.
Status PrepareDirectory(const std::string& directory);

/// All sockets, in the order of `directories`, whether a process answers or not.
std::vector<std::string> ListSockets(const std::vector<std::string>& directories);

}  // namespace baudgate::control
