// `SocketPaths` returns the possible paths of a gateway's control socket. Gateway and client try
// them in this order.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

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

/// Returns why the program that listens at the socket `path` may not be the gateway; empty: it is.
/// `listener` is the user of the program (SO_PEERCRED), `is_given` is true if the user has given
/// the path. Believed is:
///
///   folder of the socket                 a program of
///   /run/baudgate, which root makes      root, or the owner of the folder
///   $XDG_RUNTIME_DIR, /tmp/baudgate-UID  root or this user, if nobody else can write to the folder
///   of a given path                      root, this user, or the owner of the folder
///
std::string WhyNotBelieved(const std::string& path, uid_t listener, bool is_given);

/// Returns all socket files, in the order of `directories`, whether a process listens on them or
/// not.
std::vector<std::string> ListSockets(const std::vector<std::string>& directories);

}  // namespace baudgate::control
