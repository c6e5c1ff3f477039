// Civil times as meters write them: BCD second, minute, hour, weekday (1 = Monday), day, month,
// year (reference, 8.1). 31 30 15 01 02 09 02 is 2002-09-02T15:30:31.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "gateway/base/bytes.h"
#include "protocols/common/civil_zone.h"

namespace baudgate::protocols::set4tm {

inline constexpr std::size_t kCivilSize = 7;

/// Reads kCivilSize bytes. Empty: there is no such moment. The weekday is not looked at.
std::optional<CivilZone::Civil> CivilOf(View bytes);
Bytes BytesOf(CivilZone::Civil civil);

}  // namespace baudgate::protocols::set4tm
