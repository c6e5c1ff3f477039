// What a scan asks on a bus that may be one of Modbus slaves: server id (17), identification
// (43/14), loopback (8), then one read of one register. Nothing else. Goes to gateway/tools/scan
// through the descriptors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/modbus/codec.h"
#include "protocols/scanning.h"

namespace baudgate::protocols::modbus {

/// Null: not looked for, as units behind TCP.
const ScanRule* ScanOf(Framing framing);

}  // namespace baudgate::protocols::modbus
