// What only a whole line shows: times that cannot work together, more polls than the bit rate has
// room for. Lines without errors come from config/loader; warnings go to Problems. RoundOf gives
// the length of a round, CheckTiming and its neighbours check serial settings, and CheckPortServer
// checks the port over the network.
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

// Round: the line time of one poll of a group, if the device answers at once. A conversation of the
// device's protocol gives the requests; `check` shows the result and warns.
struct Round {
  std::size_t requests = 0;
  Duration time{};  ///< quiet times and characters, the shortest replies
};

/// `bus`: of the device's protocol on this line.
Round RoundOf(Group group, const Line& line, const Device& device,
              const protocols::Protocol& protocol, protocols::Bus* bus);

/// The times that the device is asked with, and who decided them.
Timing TimesInForce(const Line& line, const Device& device, const protocols::Protocol& protocol);

// Whether serial settings and named times can work: by themselves, with the port, with the
// protocol. They come from lines, devices, listeners and profiles; what is wrong goes to Problems.

/// `mark`: of the ceiling.
void CheckTiming(const Timing& timing, const Mark& mark, Problems& problems);
/// A port that knows 8N1 only can carry seven bits and a parity bit, and nothing else. `mark`: of
/// the parity.
void CheckSoftwareParity(const SerialSettings& serial, const Mark& mark, Problems& problems);
/// One of them at most. `keys`: of the map `serial`.
void CheckFlowControl(const SerialSettings& serial, const Keys& keys, Problems& problems);
/// `keys`: of the map `rs485`.
void CheckRs485(const Rs485& rs485, const Keys& keys, Problems& problems);
/// Whether characters of the protocol fit into these. `mark`: of what chose the one or the other.
void CheckDataBits(const SerialSettings& serial, const protocols::Protocol& protocol,
                   const Mark& mark, Problems& problems);
/// Refuses settings that only a port of this machine can have. `mark`: of the settings.
void CheckPortSettings(const std::string& port, const SerialSettings& serial, const Mark& mark,
                       Problems& problems);
/// What Protocol::tcp excludes: a serial port, and the keys of one. `keys`: of the line or device
/// that names the protocol; `port`: of a line; empty of a device.
void CheckTcp(const protocols::Protocol& protocol, const std::string& port, const Keys& keys,
              Problems& problems);

// Whether the port of a line may be passed on over the network, and to whom. Structs come from
// config/lines.h; what is wrong goes to Problems.

/// Reports clients beyond loopback: an error without `allow`, a warning with it. `key`:
/// "serial_server" or "lend".
void CheckPortServer(const PortServer& server, const std::string& key, Problems& problems);
/// Reports keys of the line that cannot stand together. `keys`: all keys of the line.
void CheckPortServers(const Line& line, const Keys& keys, Problems& problems);

void CheckLine(const Line& line, const Catalog& catalog, Problems& problems);

}  // namespace baudgate::config
