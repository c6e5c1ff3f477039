// Whether serial settings and named times can work: by themselves, with the port, with the
// protocol. They come from lines, devices, listeners and profiles; what is wrong goes to Problems.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "config/model/mark.h"
#include "config/model/problem.h"
#include "config/model/serial.h"
#include "config/model/timing.h"
#include "protocols/protocol.h"

namespace baudgate::config {

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
void CheckDataBits(const SerialSettings& serial, const Protocol& protocol, const Mark& mark,
                   Problems& problems);
/// What only a port of this machine can do. `mark`: of the settings.
void CheckPortSettings(const std::string& port, const SerialSettings& serial, const Mark& mark,
                       Problems& problems);
/// What Protocol::tcp excludes: a serial port, and the keys of one. `keys`: of the line or device
/// that names the protocol; `port`: of a line; empty of a device.
void CheckTcp(const Protocol& protocol, const std::string& port, const Keys& keys,
              Problems& problems);

}  // namespace baudgate::config
