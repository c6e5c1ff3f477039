// What the data of a reply says when no point of the device reads it, for `baudgate decode`: by the
// layouts that the reference prints, and as bytes where it prints none. Data comes from replies
// with a good checksum; polling asks this file for nothing that a point is given.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "protocols/conversation.h"
#include "protocols/set4tm/meter/constants.h"

namespace baudgate::protocols::set4tm {

/// Values with labels. A label is the `read` of a point where one could read the value:
/// "08 1B 00 11 float_le@0". `scale`: for integers, as far as it is known.
std::vector<Reading> ReadPrinted(View pdu, View data, const Scale& scale);

/// "E-05 E-40" of the five bytes of a status word (reference, 9.4), as .02M and .03M number them.
std::string FlagsOf(View word);

/// Whether so many data bytes may answer `pdu` in a capture: as the reference says, as it says of
/// older meters, or any where it says nothing.
bool MayAnswer(View pdu, std::size_t length);

}  // namespace baudgate::protocols::set4tm
