// The options of a device: its description, and what fills the fields of its telegrams.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string_view>

#include "protocols/protocol.h"

namespace baudgate::protocols::telegram {

inline constexpr std::string_view kTelegramsOption = "telegrams";
inline constexpr std::string_view kParametersOption = "parameters";

std::span<const OptionSpec> OptionTable();

/// A number, hex with 0x, or a word of letters, digits, '-', '_' and '.'.
Result<std::string> CanonicalAddress(std::string_view address);

}  // namespace baudgate::protocols::telegram
