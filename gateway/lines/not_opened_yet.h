// What a line's status says of its port between the start and the first attempt to open it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace baudgate {

inline constexpr std::string_view kNotOpenedYet = "not opened yet";

}  // namespace baudgate
