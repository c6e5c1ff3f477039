// What gateways, lines, devices and points may be called.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "gateway/base/result.h"

namespace baudgate::config {

/// Letters, digits and single '_' or '-' between them, at most 64 (the key length of the DDS
/// topics).
Status CheckName(std::string_view name);
/// Letters, digits and single '_' between them, no digit first: usable as an identifier everywhere.
Status CheckPointName(std::string_view name);

}  // namespace baudgate::config
