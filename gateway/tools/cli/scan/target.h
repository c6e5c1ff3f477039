// What `baudgate scan` and `baudgate ask` are pointed at: a port, or a line of the running gateway.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gateway/base/result.h"

namespace baudgate {

/// Everything else is a line of the gateway: names have no '/'.
bool IsPort(const std::string& target);

/// The error: it can be neither, and how a port would be written.
Status CheckTarget(const std::string& target);

}  // namespace baudgate
