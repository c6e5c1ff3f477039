// The integer that stands for a float value, for meters that have no floats: SET-4TM.02 and older
// ones (reference, 9.5 to 9.7). Used by the plan, by the twin and by `baudgate decode`.
//
//   08 1B 02 10 float_le@4  →  08 16 10 voltage_be@3     voltage of phase 1, four together
//   08 1B 00 40 float_le@0  →  08 11 40 hundredths_be@0  frequency, alone
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "protocols/set4tm/points.h"

namespace baudgate::protocols::set4tm {

/// Decodes the integer that 08 11, 08 14 and 08 16 give for a parameter (RWRI byte).
Decoder IntegerDecoder(std::uint8_t parameter);

/// Empty: it is no live float.
std::optional<Field> AsInteger(const Field& field);

}  // namespace baudgate::protocols::set4tm
