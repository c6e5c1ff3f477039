// What the time of a line went to in the last minutes, and whether that is why polls are missed.
// Pure; for gateway/status/diagnose.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include "gateway/store/line_status.h"
#include "gateway/store/point_store.h"

namespace baudgate::control {

/// The part of its poll periods that was missed in the last five minutes; a small part counts as
/// none.
double MissedShare(const DeviceRecord& device, Now now, Instant started);

/// Why there is no time, and what to do: "feeder-1 takes 62 % of the line's time, 350 ms an
/// exchange: raise its poll, …". Empty: exchanges that fail take it, and their device says why; or
/// it is not known. `device`: "it" in place of its name; null: nobody.
std::string WhyNoTime(const LineStatus& line, std::span<const DeviceRecord> devices,
                      const DeviceRecord* device, Now now, Instant started);

}  // namespace baudgate::control
