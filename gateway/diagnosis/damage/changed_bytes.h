// Recognises what converters and serial servers do to the bytes of a reply: insert, remove or
// replace bytes, or invert all bits. ChangedBytes undoes each possible change; if the result is a
// complete reply, the change is proven. The functions have no state. nearly_reply.cpp uses
// ChangedBytes, examine.cpp uses DecimalComma and DoubledBytes, earlier_replies.cpp uses LacksSome.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "gateway/base/bytes.h"
#include "gateway/base/finding.h"
#include "gateway/diagnosis/damage/examine.h"

namespace baudgate::diagnosis {

/// Recognises by the bits of the characters that text was sent at half or twice the configured bit
/// rate. `connection`: the bit rate is configured at a serial server.
std::optional<Finding> OtherBitRate(View heard, bool connection);

std::optional<Finding> ChangedBytes(const Hearing& hearing, View heard);
/// True if `heard` equals `reply` (a later reply to the same request) without one or two of its
/// bytes. A text may lack more, and may contain another value.
bool LacksSome(View heard, View reply);
/// Recognises a text with decimal commas that is a complete reply, or would be one with points in
/// their place.
std::optional<Finding> DecimalComma(const Hearing& hearing, View heard);
/// Recognises that each byte came twice, whatever the bytes mean.
std::optional<Finding> DoubledBytes(const Hearing& hearing, View heard);

bool IsWhole(const Hearing& hearing, View heard);
/// True for printable ASCII characters and for CR, LF and tab.
bool IsPrintable(std::uint8_t byte);

}  // namespace baudgate::diagnosis
