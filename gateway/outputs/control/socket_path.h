// Where the control socket of a gateway is: the one order of places that daemon and client share.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "gateway/base/result.h"

namespace baudgate::control {

/// /run/baudgate (made by systemd), $XDG_RUNTIME_DIR/baudgate, /tmp/baudgate-UID, in this order.
std::vector<std::string> SocketDirectories();

/// NAME.sock in each of them.
std::vector<std::string> SocketPaths(const std::string& gateway);

/// Makes the directory of a default place other than /run/baudgate where it is missing. One that
/// another user owns or may write to is refused: that user could impersonate the gateway.
Status PrepareDirectory(const std::string& directory);

/// All sockets in the default places, in their order, whether anybody answers there or not.
std::vector<std::string> ListSockets(const std::vector<std::string>& directories);

}  // namespace baudgate::control
