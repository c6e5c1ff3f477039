// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <string>

namespace baudgate {

/// "baudgate"; of a user without a name its number. A name that was found once is remembered: it
/// counts while the users of the system cannot be read, or are not read within a second. From any
/// thread.
std::string NameOfUser(uid_t user);

}  // namespace baudgate
