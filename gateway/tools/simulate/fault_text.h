// Faults of a twin as the user writes them: "bits:rate=0.1,count=2,every=60s,for=20s".
// Read from `simulate --fault`; docs/faults.md lists kinds and keys.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "gateway/base/result.h"
#include "gateway/tools/simulate/twin_faults.h"

namespace baudgate {

/// An error names the fault and the key, and says what may stand there.
Result<Fault> ParseFault(std::string_view text);

}  // namespace baudgate
