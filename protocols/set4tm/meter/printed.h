// ReadPrinted decodes replies by the layouts in the reference, or as bytes if the reference has
// none. It serves replies that no point reads, above all in `baudgate decode`.
#pragma once

#include <string>
#include <vector>

#include "protocols/conversation.h"
#include "protocols/set4tm/meter/constants.h"

namespace baudgate::protocols::set4tm {

/// Returns the values of a reply with labels. If a point could read a value, the label is its
/// `read` text: "08 1B 00 11 float_le@0". `scale`: the constants for integers, as far as they are
/// known.
std::vector<Reading> ReadPrinted(View pdu, View data, const Scale& scale);

/// Returns the flags that are set in a status word, such as "E-05 E-40". Their numbers are those of
/// .02M and .03M (reference, 9.4).
std::string FlagsOf(View word);

/// True if a captured reply to `pdu` can have `length` data bytes: the length in the reference, the
/// length of older meters, or any length if the reference does not define it.
bool MayAnswer(View pdu, std::size_t length);

}  // namespace baudgate::protocols::set4tm
