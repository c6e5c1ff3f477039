// What hardly anybody means: values that would be wrong or bad without a word.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "protocols/protocol.h"

namespace baudgate::protocols::telegram {

std::vector<Doubt> DoubtsOf(const config::Device& device);

/// What numbers the field of the point can say.
config::RawNumbers NumbersOf(const config::Device& device, const config::Point& point);

}  // namespace baudgate::protocols::telegram
