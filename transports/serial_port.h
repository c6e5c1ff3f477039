// `MakeSerialPort` makes a transport for a tty or pty. OpenExclusive opens a tty for this program
// alone, and CloseElsewhere closes descriptors on another thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <memory>
#include <string>

#include "gateway/base/result.h"
#include "transports/transport.h"

namespace baudgate::transports {

/// Opens the port without waiting for a carrier and takes the exclusive locks. The caller owns the
/// descriptor. The error names the fault and the remedy.
Result<int> OpenExclusive(const std::string& port);

/// Releases the locks of OpenExclusive. It is called before a close that can take long, so that the
/// next open (by this program or another) succeeds meanwhile.
void ReleaseLocks(int fd);

/// True if members of `group` can read and write a port with `mode`. False for root's group.
bool IsGroupForPorts(gid_t group, mode_t mode);
/// Returns shell commands that let a group of users open the port, for error messages.
std::string HowToGive(const std::string& port);

std::string OpenErrorText(const std::string& port, int error);

// CloseElsewhere exists because Linux waits up to 30 s in close() of a serial port whose output
// does not drain.

/// The maximum number of threads that close descriptors; further descriptors wait in a queue.
inline constexpr int kMostClosers = 8;

/// Closes `fd` on another thread and returns at once. Thread-safe.
void CloseElsewhere(int fd);

/// `listener` must outlive the transport.
std::unique_ptr<Transport> MakeSerialPort(std::string port, const config::SerialSettings& serial,
                                          asio::io_context& io, TransportListener& listener);

}  // namespace baudgate::transports
