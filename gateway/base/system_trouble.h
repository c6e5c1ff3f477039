// Names the cause and the cure of a failed system call in words for users.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>

namespace baudgate {

/// `error`: an errno. "too many open files; raise LimitNOFILE of the service (ulimit -Hn)".
std::string SystemTrouble(int error);

/// The process has used up its file descriptors.
bool NoFileLeft();

/// The largest size of a file that this process may write, in bytes. Empty: no limit.
std::optional<std::size_t> MostFileBytes();

}  // namespace baudgate
