// Whether what was printed has arrived: the last thing a command does.
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace baudgate {

/// The exit code behind output of which `code` was the result. What a full disk has swallowed must
/// not look like success (4); a reader that has left has seen what it wanted.
int AfterOutput(int code);

}  // namespace baudgate
