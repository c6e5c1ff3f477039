// What a simulated meter keeps of its energies: registers at the begin of months and days, which
// follow from that begin alone.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "gateway/base/bytes.h"
#include "protocols/common/civil_zone.h"

namespace baudgate::protocols::set4tm {

/// Counts of A+, A-, R+, R- at the begin of that day, of all tariffs (0) or one.
std::array<std::uint32_t, 4> TwinCounts(std::chrono::local_days begin, unsigned tariff);

/// The reply to 0A 83, 84 or 86 at that time by the meter's clock; empty: that is another
/// request.
std::optional<Bytes> TwinRegisters(View pdu, CivilZone::Civil now);

}  // namespace baudgate::protocols::set4tm
