// The log of the service, as systemd keeps it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gateway/base/result.h"

namespace baudgate {

/// The newest lines of baudgate and baudgate-dds. The error says why there are none.
Result<std::string> SystemLog();

}  // namespace baudgate
