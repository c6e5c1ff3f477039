// What asking for the points of a group once takes of the line, if the device answers without
// thinking. From a conversation of the device's protocol; told by `check` and its warnings.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "config/model/line.h"
#include "gateway/base/time.h"
#include "protocols/protocol.h"

namespace baudgate::config {

struct Round {
  std::size_t requests = 0;
  Duration time{};  ///< quiet times and characters, the shortest replies
};

/// `bus`: of the device's protocol on this line.
Round RoundOf(Group group, const Line& line, const Device& device, const Protocol& protocol,
              Bus* bus);

/// The times that the device is asked with, and who decided them.
Timing TimesInForce(const Line& line, const Device& device, const Protocol& protocol);

}  // namespace baudgate::config
