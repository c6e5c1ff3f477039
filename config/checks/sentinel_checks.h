// Checks that a device can send the `sentinels` of its points. Where the protocol reads whole
// numbers, a sentinel must lie within their range, and a sentinel in hex stands for their bits.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/model/device.h"
#include "config/model/problem.h"
#include "protocols/protocol.h"

namespace baudgate::config {

/// Turns sentinels in hex into numbers, and reports sentinels that the device can never send or
/// that stand twice. Example: 0x8000 becomes -32768 if the protocol reads an int16, whatever the
/// type of the point is. Without a protocol the type of the point decides.
void ResolveSentinels(Device& device, const Protocol* protocol, Problems& problems);

}  // namespace baudgate::config
