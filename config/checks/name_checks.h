// What gateways, lines, devices and points may be called.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "gateway/base/result.h"

namespace baudgate::config {

/// Letters, digits and single '_' or '-' between them, at most 64 (the key length of the DDS
/// topics).
Status CheckName(std::string_view name);
/// Letters, digits and single '_' before or between them, no digit first: an identifier of IEC
/// 61131-3, and usable as one everywhere.
Status CheckPointName(std::string_view name);

}  // namespace baudgate::config
