// Numbers that nothing measures, such as bytes in another order make. Pure; used by
// gateway/status/diagnose_points.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "gateway/store/point_store.h"

namespace baudgate::control {

/// One sentence, or none.
std::vector<std::string> AbsurdNumbers(const DeviceRecord& record, Now now);

}  // namespace baudgate::control
