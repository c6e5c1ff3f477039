// Opens a tty for this program alone, and says in words why that did not work.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <string>

#include "gateway/base/result.h"

namespace baudgate {

/// Opens without waiting for a carrier and takes the exclusive locks. The descriptor is the
/// caller's.
Result<int> OpenExclusive(const std::string& port);

/// Gives the locks back; to be called before a close that may take long, so that the next open
/// (ours or a vendor tool's) does not have to wait for it.
void ReleaseLocks(int fd);

/// Whether people in this group may use a port of this mode. Not so where it is root's.
bool IsGroupForPorts(gid_t group, mode_t mode);
/// Commands that give the port to such a group.
std::string HowToGive(const std::string& port);

/// A sentence for the log about a failed open(2): what is wrong and what to do.
std::string OpenErrorText(const std::string& port, int error);

}  // namespace baudgate
