// Bytes that would be a whole reply but for one thing: the first or last byte is missing, a
// converter has inserted characters or changed line ends, there is a parity bit too many. Pure;
// used by gateway/diagnosis/damage/examine.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "gateway/base/bytes.h"
#include "gateway/base/finding.h"
#include "gateway/diagnosis/damage/examine.h"

namespace baudgate {

std::optional<Finding> NearlyReply(const Hearing& hearing, View heard);
/// The check value of a reply proves that its first byte alone is missing.
bool LacksFirstByte(const Hearing& hearing, View heard);
/// A text without the character that a reply begins with, and ":" and the digits of a check value
/// at its end.
bool EndsInCheckValue(const Hearing& hearing, View heard);
/// Its check value is missing; or, where the reply ends in it, as many bytes inside.
std::optional<Finding> TooShort(const Hearing& hearing, View heard);

}  // namespace baudgate
