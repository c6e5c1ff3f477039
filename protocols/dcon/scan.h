// What a scan asks on a bus that may be one of DCON modules: `$AAM` and `$AA2`, with and without a
// checksum, the only two commands that no module takes for a write in either mode. Nothing else.
// Modules that know neither (OWEN's) are not found. Goes to gateway/tools/scan through the
// descriptor.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/scanning.h"

namespace baudgate::protocols::dcon {

extern const ScanRule kScan;

}  // namespace baudgate::protocols::dcon
