// What converters and serial servers do to the bytes of a reply: put some in, take some out, give
// others in their place, turn every bit round. Undone, the reply is whole. Pure.
// OtherBitRate recognises characters that were sent at half or twice the bit rate. In this folder
// nearly_reply.cpp uses ChangedBytes, examine.cpp DecimalComma and DoubledBytes, and
// earlier_replies.cpp LacksSome.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "gateway/base/bytes.h"
#include "gateway/base/finding.h"
#include "gateway/diagnosis/damage/examine.h"

namespace baudgate::diagnosis {

// Characters that were sent at half or twice the bit rate at which they are read, as their bits
// tell. Pure; used by ChangedBytes.

/// `connection`: to a serial server, which has the bit rate.
std::optional<Finding> OtherBitRate(View heard, bool connection);

std::optional<Finding> ChangedBytes(const Hearing& hearing, View heard);
/// It is the reply to the same request a moment later, but for one or two bytes that are missing.
bool LacksSome(View heard, View reply);
/// A text that is whole with decimal points in place of its commas, or as it is.
std::optional<Finding> DecimalComma(const Hearing& hearing, View heard);
/// Each byte comes twice, whatever is in it.
std::optional<Finding> DoubledBytes(const Hearing& hearing, View heard);

/// A whole reply is in it.
bool IsWhole(const Hearing& hearing, View heard);
/// A character for people, or the end of a line.
bool IsPrintable(std::uint8_t byte);

}  // namespace baudgate::diagnosis
