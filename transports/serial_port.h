// A tty or pty as a transport: bytes come from and go to the device file of the configuration.
// OpenExclusive opens a tty for this program alone, and CloseElsewhere closes descriptors away from
// the line's thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <memory>
#include <string>

#include "gateway/base/result.h"
#include "transports/transport.h"

namespace baudgate::transports {

// Opens a tty for this program alone, and says in words why that did not work.

/// Opens without waiting for a carrier and takes the exclusive locks. The descriptor is the
/// caller's.
Result<int> OpenExclusive(const std::string& port);

/// Gives the locks back; to be called before a close that may take long, so that the next open
/// (ours or a vendor tool's) does not have to wait for it.
void ReleaseLocks(int fd);

/// Whether people in this group may use a port of this mode. Not so where it is root's.
bool IsGroupForPorts(gid_t group, mode_t mode);
/// Commands that give the port to such a group.
std::string HowToGive(const std::string& port);

/// A sentence for the log about a failed open(2): what is wrong and what to do.
std::string OpenErrorText(const std::string& port, int error);

// Closes file descriptors away from the line's thread: Linux waits up to 30 s in close() of a
// serial port whose output does not drain. Descriptors come from serial_port and end here.

/// At most so many closes wait at the same time, in a thread each; further descriptors queue.
inline constexpr int kMostClosers = 8;

/// Takes the descriptor over and returns at once. May be called from any thread.
void CloseElsewhere(int fd);

/// `listener` outlives the transport.
std::unique_ptr<Transport> MakeSerialPort(std::string port, const config::SerialSettings& serial,
                                          asio::io_context& io, TransportListener& listener);

}  // namespace baudgate::transports
