// Other services than a line of devices, by what they say over TCP: a web server, SSH, TLS, Telnet,
// IEC 60870-5-104.
// Pure.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "gateway/base/bytes.h"
#include "gateway/base/finding.h"

namespace baudgate {

/// Empty: no known service. `modbus`: a Modbus TCP server is expected there, not a serial server.
std::optional<Finding> OtherService(View heard, bool modbus);
/// IAC and WILL, WONT, DO or DONT, at the front.
bool IsTelnet(View heard);

}  // namespace baudgate
