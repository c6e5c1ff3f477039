// Recognises what converters and serial servers do to the bytes of a reply: insert, remove or
// replace bytes, or invert all bits. ChangedBytes undoes each change; if the reply is whole then,
// the change is proven. All functions are pure. nearly_reply.cpp uses ChangedBytes, examine.cpp
// DecimalComma and DoubledBytes, earlier_replies.cpp LacksSome.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "gateway/base/bytes.h"
#include "gateway/base/finding.h"
#include "gateway/diagnosis/damage/examine.h"

namespace baudgate::diagnosis {

/// Recognises by the bits of its characters that text was sent at half or twice the bit rate at
/// which it is read. `connection`: the bit rate is set at a serial server.
std::optional<Finding> OtherBitRate(View heard, bool connection);

std::optional<Finding> ChangedBytes(const Hearing& hearing, View heard);
/// True if `heard` is like `reply`, a later reply to the same request, without one or two bytes.
bool LacksSome(View heard, View reply);
/// A text with decimal commas. With points instead of commas, or as it is, it is a whole reply.
std::optional<Finding> DecimalComma(const Hearing& hearing, View heard);
/// Each byte comes twice, whatever the bytes mean.
std::optional<Finding> DoubledBytes(const Hearing& hearing, View heard);

/// True if `heard` contains a whole reply.
bool IsWhole(const Hearing& hearing, View heard);
/// True for printable ASCII and for CR, LF and tab.
bool IsPrintable(std::uint8_t byte);

}  // namespace baudgate::diagnosis
