// Decodes replies that no point reads, for `baudgate decode`: by the layouts in the reference, or
// as bytes if the reference has none. Polling uses it only for values without a point.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "protocols/conversation.h"
#include "protocols/set4tm/meter/constants.h"

namespace baudgate::protocols::set4tm {

/// Returns values with labels. If a point could read a value, the label is its `read` text: "08 1B
/// 00 11 float_le@0". `scale`: the constants for integers, as far as they are known.
std::vector<Reading> ReadPrinted(View pdu, View data, const Scale& scale);

/// Returns the flags in a status word, "E-05 E-40", numbered as for .02M, .03M (reference, 9.4).
std::string FlagsOf(View word);

/// True if a reply to `pdu` may have `length` data bytes in a capture: the length in the reference,
/// the length of older meters, or any length if the reference does not define it.
bool MayAnswer(View pdu, std::size_t length);

}  // namespace baudgate::protocols::set4tm
