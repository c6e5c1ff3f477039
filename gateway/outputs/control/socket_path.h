// `SocketPaths` returns where the control socket of a gateway may be. Gateway and client try the
// places in this order.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "gateway/base/result.h"

namespace baudgate::control {

/// Returns /run/baudgate (made by systemd), $XDG_RUNTIME_DIR/baudgate and /tmp/baudgate-UID, in
/// this order.
std::vector<std::string> SocketDirectories();

/// Returns the path of NAME.sock in each directory.
std::vector<std::string> SocketPaths(const std::string& gateway);

/// Makes `directory` if it is missing, except /run/baudgate. An error if another user owns the
/// directory or may write to it, because that user could impersonate the gateway.
Status PrepareDirectory(const std::string& directory);

/// Returns all sockets in `directories`, in their order, whether a process answers or not.
std::vector<std::string> ListSockets(const std::vector<std::string>& directories);

}  // namespace baudgate::control
