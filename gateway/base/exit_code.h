// Exit codes of the commands, for scripts. The man pages (packaging/man) list them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace baudgate {

inline constexpr int kExitDone = 0;
inline constexpr int kExitUsage = 2;
inline constexpr int kExitBadConfiguration = 3;
inline constexpr int kExitCanNot = 4;  ///< a file, a port or the machine refuses

}  // namespace baudgate
