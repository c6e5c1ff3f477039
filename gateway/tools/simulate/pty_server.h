// Which program serves the pty that a symbolic link leads to, so that no other takes the link of a
// running twin.
//
//   link -> /dev/pts/7, no /dev/pts/7                 nobody: its program has ended
//   link -> /dev/pts/7, which was made after the link nobody: the number has been given away again
//   link -> /dev/pts/7, which was made before         served
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

namespace baudgate {

/// "socat (pid 4711)", "another program" where it may not be known; empty: it is not served.
/// `target`: what `link` says, "/dev/pts/7".
std::optional<std::string> ServerOf(const std::string& link, const std::string& target);

}  // namespace baudgate
