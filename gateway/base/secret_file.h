// `ReadSecretFile` reads a password or a token that a user has put into a file.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gateway/base/result.h"

namespace baudgate {

/// Returns the first line of the file without spaces at its ends. `what` begins the error: "the
/// password file". An error if the file cannot be read, is no regular file, can be read or changed
/// by other users than its owner (it needs mode 0600), or its first line is empty or longer than
/// 256 bytes. `by_group`: the group may read the file, as with credentials of systemd.
Result<std::string> ReadSecretFile(const std::string& what, const std::string& file,
                                   bool by_group = false);

}  // namespace baudgate
