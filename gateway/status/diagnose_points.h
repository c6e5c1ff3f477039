// What is said of the points of a device that answers. Pure; used by gateway/status/diagnose.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "gateway/store/line_status.h"
#include "gateway/store/point_store.h"

namespace baudgate::control {

/// "bay-1.feeder-1".
std::string NameOf(const DeviceRecord& record);

/// It refuses points that it gave before, all of them.
bool RefusesWhatItGave(const DeviceRecord& record);

/// It is not what it should be, so that no value of it is good.
bool IsForeign(const DeviceRecord& record);

/// Values that are not good although the device answers. Their age is not spoken of before the port
/// of `line` has been open as long as they may be old: their polls had no chance yet.
std::vector<std::string> DiagnosePoints(const LineStatus& line, const DeviceRecord& record,
                                        Now now);

/// Points that are polled and have never had a value, although the device answers.
std::vector<std::string> DiagnoseWaiting(const DeviceRecord& record, Now now, Instant started);

}  // namespace baudgate::control
