// The descriptors of Modbus RTU and Modbus ASCII, masters: one protocol on two framings.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/protocol.h"

namespace baudgate {

const Protocol& ModbusRtuProtocol();
const Protocol& ModbusAsciiProtocol();

}  // namespace baudgate
