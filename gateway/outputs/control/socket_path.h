// `SocketPaths` returns the possible paths of a gateway's control socket. Gateway and client try
// them in this order.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "gateway/base/result.h"

namespace baudgate::control {

/// Returns /run/baudgate (created by systemd), $XDG_RUNTIME_DIR/baudgate and /tmp/baudgate-UID.
std::vector<std::string> SocketDirectories();

std::vector<std::string> SocketPaths(const std::string& gateway);

/// Creates `directory` if it is missing, except /run/baudgate. Refuses a directory that another
/// user owns or can write to, because that user could impersonate the gateway.
Status PrepareDirectory(const std::string& directory);

/// Returns all socket files, in the order of `directories`, whether a process listens on them or
/// not.
std::vector<std::string> ListSockets(const std::vector<std::string>& directories);

}  // namespace baudgate::control
