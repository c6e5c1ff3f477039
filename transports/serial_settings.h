// Puts a tty into raw mode with the settings of the configuration and checks that the driver really
// took them. Works on file descriptors; all calls return at once.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "config/config.h"
#include "gateway/base/result.h"
#include "transports/transport.h"

namespace baudgate {

inline constexpr int kLowestBaud = 300;
inline constexpr int kHighestBaud = 921600;

/// A pty has no bit rate, parity or hang-up delay, and forgets such settings without saying so.
bool IsPty(int fd);

/// Everything in one go: raw mode, PARMRK (parmrk.h reads it), speed and format, RS-485, low
/// latency. `serial` is what the wire shall see (OnTheWire of parity.h). `port` is for messages.
Status ApplySerialSettings(int fd, const config::SerialSettings& serial, const std::string& port);

/// Raw mode without anything else, for the far end of a pty.
Status MakeRaw(int fd);

/// Speed, format and flow control that the driver says it uses now.
Result<config::SerialSettings> ReadSerialSettings(int fd);

/// Whether a driver that was asked for one thing and reports another did well enough: the speed may
/// differ by the rounding of its divider, nothing else may. The error says what to do.
Status CompareSettings(const config::SerialSettings& asked, const config::SerialSettings& actual,
                       const std::string& port);

bool SameSettings(const config::SerialSettings& a, const config::SerialSettings& b);

/// Totals since the driver was loaded; nothing where it does not count.
std::optional<PortCounters> ReadDriverCounters(int fd);

/// Throws away what the port has received and nobody has read.
void FlushInput(int fd);
/// And what it has not sent yet, too.
void FlushAll(int fd);

}  // namespace baudgate
