// What is wrong between the points of a device and its telegrams.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "protocols/protocol.h"

namespace baudgate::protocols::telegram {

/// What can be seen of the whole device only: telegrams that are not described, fields that no
/// answer has, parameters that nobody gives.
std::vector<Doubt> FaultsOf(const config::Device& device);

}  // namespace baudgate::protocols::telegram
