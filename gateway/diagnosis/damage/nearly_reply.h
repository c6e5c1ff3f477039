// NearlyReply recognises bytes that are a whole reply except for one fault: the first or last byte
// is missing, a converter has inserted characters or changed line ends, or there is an extra parity
// bit. StrayBeside recognises bytes beside a good reply. No function does I/O. examine.cpp uses
// them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>

#include "gateway/base/bytes.h"
#include "gateway/base/finding.h"
#include "gateway/diagnosis/damage/examine.h"

namespace baudgate::diagnosis {

std::optional<Finding> NearlyReply(const Hearing& hearing, View heard);
/// True if only the first byte is missing: the check value of the reply proves it.
bool LacksFirstByte(const Hearing& hearing, View heard);
/// True for a text that lacks the first character of a reply, but ends in ":" and the digits of a
/// check value.
bool EndsInCheckValue(const Hearing& hearing, View heard);
/// Recognises a reply that is too short by the length of its check value: either the check value is
/// missing, or as many bytes inside the reply are missing, and the check value at its end came.
std::optional<Finding> TooShort(const Hearing& hearing, View heard);

// Bytes beside a good reply: a message that the protocol recognises, text for people, or noise.

/// A driver that starts or stops driving the bus can cause up to this many bytes.
inline constexpr std::size_t kHarmless = 3;

/// Lets the protocol recognise bytes that are not a reply: see protocols::Recognised.
std::optional<Finding> Recognise(const Hearing& hearing, View heard);
/// True if both replies and `part` consist of hexadecimal digits and line ends only.
bool IsHexText(const Hearing& hearing, View part);
/// Recognises a message of another device or master, or readable text.
std::optional<Finding> Stranger(const Hearing& hearing, View part);
/// Returns the finding for bytes before and after a reply that are not a message: noise, a few
/// bytes, or too few to report.
Finding StrayBeside(const Hearing& hearing, View before, View behind);

}  // namespace baudgate::diagnosis
