// Functions that a process calls before everything else, because it can have been started with
// closed descriptors, or as process 1 of a container.
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace baudgate {

/// Opens the descriptors 0 to 2 that are closed. Otherwise the first files of the program would get
/// these numbers, and the log would be written into these files.
void HoldStandardDescriptors();

/// If the process is process 1 (of a container), forks and returns in the child. The parent passes
/// signals on to the child, reaps every process that has lost its parent, and ends with the result
/// of the child. Must be called before any thread starts.
void SplitFromInit();

}  // namespace baudgate
