// What a scan asks on a bus that may be a SPA bus: `F`, who are you, with a real checksum and with
// XX. Nothing else. Goes to gateway/tools/scan through the descriptor.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/scanning.h"

namespace baudgate::protocols::spabus {

extern const ScanRule kScan;

}  // namespace baudgate::protocols::spabus
