// What is said of a device that speaks when it likes. Pure.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "gateway/status/evidence.h"

namespace baudgate::control {

/// Nothing that it says can be read, or much cannot.
std::vector<std::string> Unreadable(const DeviceRecord& record, const Evidence& evidence);
std::vector<std::string> Silence(const DeviceRecord& record, Now now);

}  // namespace baudgate::control
