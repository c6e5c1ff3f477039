// How a command ends, for scripts: docs and man pages list these.
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace baudgate {

inline constexpr int kExitDone = 0;
inline constexpr int kExitUsage = 2;             ///< words that are not understood
inline constexpr int kExitBadConfiguration = 3;  ///< or a bad profile
inline constexpr int kExitCanNot = 4;            ///< a file, a port or the machine says no

}  // namespace baudgate
