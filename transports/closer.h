// Closes file descriptors away from the line's thread: Linux waits up to 30 s in close() of a
// serial port whose output does not drain. Descriptors come from serial_port and end here.
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace baudgate {

/// At most so many closes wait at the same time, in a thread each; further descriptors queue.
inline constexpr int kMostClosers = 8;

/// Takes the descriptor over and returns at once. May be called from any thread.
void CloseElsewhere(int fd);

}  // namespace baudgate
