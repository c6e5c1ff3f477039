// What a scan asks on a bus that may be one of SET-4TM meters: the link test, whose reply looks
// like its echo, and the serial number, which proves that somebody has answered; a meter says it
// only where its channel is open. Nothing else. Goes to gateway/tools/scan through the descriptor.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/scanning.h"

namespace baudgate::protocols::set4tm {

extern const ScanRule kScan;

}  // namespace baudgate::protocols::set4tm
