// Checks a whole line: times that cannot work together, and more polls than the bit rate allows.
// RoundOf computes how long one poll of a group takes, CheckTiming and the functions below it check
// serial settings, and CheckPortServer checks the port over the network.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include "config/catalog/catalog.h"
#include "config/model/line.h"
#include "config/model/problem.h"
#include "config/model/serial.h"
#include "config/model/timing.h"
#include "gateway/base/time.h"
#include "protocols/protocol.h"

namespace baudgate::config {

// Round is the time for which one poll of a group occupies the line, if the device replies at once.
// The requests come from a conversation of the device's protocol.
struct Round {
  std::size_t requests = 0;
  /// Contains the quiet times and the duration of all characters of the requests and of their
  /// shortest replies.
  Duration time{};
};

/// Computes the Round of one poll of `group`. `bus` is the Bus of the device's protocol on this
/// line.
Round RoundOf(Group group, const Line& line, const Device& device,
              const protocols::Protocol& protocol, protocols::Bus* bus);

/// Returns the times that apply to the device. Timing::from names the source of each.
Timing TimesInForce(const Line& line, const Device& device, const protocols::Protocol& protocol);

/// Reports a ceiling, the timeout of the whole exchange, that is shorter than the reply time.
/// `mark` is the position of the key `ceiling` in the file.
void CheckTiming(const Timing& timing, const Mark& mark, Problems& problems);
/// Checks that software parity is used with 7E1 or 7O1, because a port with 8N1 only can transmit
/// nothing else. `mark` is the position of the parity in the file.
void CheckSoftwareParity(const SerialSettings& serial, const Mark& mark, Problems& problems);
/// Checks that at most one flow control is set, and no rtscts with rs485. `keys` are the keys of
/// the map `serial`.
void CheckFlowControl(const SerialSettings& serial, const Keys& keys, Problems& problems);
/// Checks that the delays are whole milliseconds. `keys` are those of the map `rs485`.
void CheckRs485(const Rs485& rs485, const Keys& keys, Problems& problems);
/// Checks that the settings have enough data bits for the protocol, and that XON/XOFF takes no
/// bytes that the protocol sends. `mark` is the position of the key `serial` or `protocol` of the
/// line or device in the file.
void CheckDataBits(const SerialSettings& serial, const protocols::Protocol& protocol,
                   const Mark& mark, Problems& problems);
/// If `port` is a serial server (tcp://), reports settings that only a port of this machine
/// supports. `mark` is the position of the settings in the file.
void CheckPortSettings(const std::string& port, const SerialSettings& serial, const Mark& mark,
                       Problems& problems);
/// If the protocol runs over TCP only, reports a serial port and the keys of serial ports. `keys`
/// are those of the line or device that names the protocol; `port` is the line's port, or empty for
/// a device.
void CheckTcp(const protocols::Protocol& protocol, const std::string& port, const Keys& keys,
              Problems& problems);

/// Reports a port for network clients (PortServer) that other machines can reach: an error without
/// `allow`, else a warning. `key` is "serial_server" or "lend".
void CheckPortServer(const PortServer& server, const std::string& key, Problems& problems);
/// Reports keys of the line that contradict `serial_server` or `lend`, or that have no effect
/// beside them. `keys` are all keys of the line.
void CheckPortServers(const Line& line, const Keys& keys, Problems& problems);

void CheckLine(const Line& line, const Catalog& catalog, Problems& problems);

}  // namespace baudgate::config
