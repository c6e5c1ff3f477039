// Bytes that would be a whole reply but for one thing: the first or last byte is missing, a
// converter has inserted characters or changed line ends, there is a parity bit too many. Pure;
// used by gateway/diagnosis/damage/examine.h. StrayBeside recognises what stands beside a good
// reply.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>

#include "gateway/base/bytes.h"
#include "gateway/base/finding.h"
#include "gateway/diagnosis/damage/examine.h"

namespace baudgate::diagnosis {

std::optional<Finding> NearlyReply(const Hearing& hearing, View heard);
/// The check value of a reply proves that its first byte alone is missing.
bool LacksFirstByte(const Hearing& hearing, View heard);
/// A text without the character that a reply begins with, and ":" and the digits of a check value
/// at its end.
bool EndsInCheckValue(const Hearing& hearing, View heard);
/// Its check value is missing; or, where the reply ends in it, as many bytes inside.
std::optional<Finding> TooShort(const Hearing& hearing, View heard);

// Bytes beside a good reply: a message that the protocol recognises, words, or noise. Pure; used by
// gateway/diagnosis/damage/examine.h.

/// A driver that takes or leaves the bus may make so many bytes of nothing.
inline constexpr std::size_t kHarmless = 3;

/// Bytes that are no reply, as the protocol recognises them: see Recognised.
std::optional<Finding> Recognise(const Hearing& hearing, View heard);
/// Digits and line ends, where replies are made of them.
bool IsHexText(const Hearing& hearing, View part);
/// A message of somebody else, or words.
std::optional<Finding> Stranger(const Hearing& hearing, View part);
/// Bytes before and behind the reply that are no message: noise, a few bytes, or nothing worth a
/// word.
Finding StrayBeside(const Hearing& hearing, View before, View behind);

}  // namespace baudgate::diagnosis
