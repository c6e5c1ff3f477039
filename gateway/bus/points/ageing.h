// How good a stored value is at a moment: what the last reading said, made worse by doubt, by age
// and by the state of device and line. Pure; the point store has the records.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "gateway/bus/points/device_record.h"

namespace baudgate {

/// By config::Group. `line_cycle`: the measured time that the line needs to read all its fast
/// points once; no value is too old before two of them.
std::array<AgeLimits, config::kGroups> LimitsOf(const config::Device& device, Duration line_cycle);

/// What the last reading said, made worse by doubt and age; the state of device and line left out.
Quality AgedQuality(const DeviceRecord& record, std::size_t point, Instant now);

/// In this order of precedence: out of service, line down, device offline, another
/// device than it should be, never read, reported trouble, then age.
Quality QualityAt(const DeviceRecord& record, std::size_t point, Instant now);

/// Since the reading; empty before the first.
std::optional<Duration> AgeAt(const DeviceRecord& record, std::size_t point, Instant now);

/// When age alone changes the point's quality next, seen from `now`; empty: never.
std::optional<Instant> NextAgeing(const DeviceRecord& record, std::size_t point, Instant now);

}  // namespace baudgate
