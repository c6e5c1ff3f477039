// What is said of bytes that come beside good replies. Pure.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "gateway/status/evidence.h"

namespace baudgate::control {

/// Bytes beside good replies, of the exchanges that are kept.
inline constexpr std::size_t kNotableNoise = 3;

/// The same bytes stand around nearly all of its replies.
bool IsWrapped(const DeviceRecord& record);
/// Two devices have its address: many of their replies are alike, and a repeater never changes one.
bool AreTwo(const Findings& findings);
/// Where it is not the line's (gateway/status/diagnose_line.cpp). `alone`: beside the replies of
/// its neighbours nothing stands.
std::vector<std::string> Beside(const DeviceRecord& record, bool alone);

}  // namespace baudgate::control
