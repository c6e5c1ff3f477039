// What a process does before anything else, because of how it may have been started.
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace baudgate {

/// Where a program is started with descriptors 0 to 2 closed, its first files would get these
/// numbers, and the log would be written into them.
void HoldStandardDescriptors();

/// As process 1 of a container: returns in a child. The parent passes signals on to it, takes the
/// end of every process that has lost its parent, and ends as the child does. Before any thread.
void SplitFromInit();

}  // namespace baudgate
