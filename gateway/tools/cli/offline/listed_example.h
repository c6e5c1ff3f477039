// The example of a register list, as the twin of the device shows it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "gateway/base/decimal.h"
#include "gateway/base/result.h"

namespace baudgate {

/// "0.1", "0,1", "1E-05".
std::optional<Decimal> ListedNumber(const std::string& text);

/// The raw value behind `simulate:`, as YAML has it: "2304" of "230,4" at a scale of 0.1,
/// 1795737600 of "2026-11-27" where the form is DATE. `form`: what the registers hold. The error
/// says why they cannot hold it.
Result<std::string> ListedExample(const std::string& text, const std::string& form,
                                  const Decimal& scale);

}  // namespace baudgate
