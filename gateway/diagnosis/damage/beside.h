// Bytes beside a good reply: a message that the protocol recognises, words, or noise. Pure; used by
// gateway/diagnosis/damage/examine.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>

#include "gateway/base/bytes.h"
#include "gateway/base/finding.h"
#include "gateway/diagnosis/damage/examine.h"

namespace baudgate {

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

}  // namespace baudgate
