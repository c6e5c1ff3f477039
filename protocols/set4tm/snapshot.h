// Which float parameter stands at which bit of the 08 23 mask (reference, 9.8), so that many values
// come in one exchange. Used by the planner, by the decoder and by the twin.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "gateway/base/bytes.h"

namespace baudgate::protocols::set4tm {

/// 1 + 23 * 4 data bytes fill the 96 bytes of a frame.
inline constexpr std::size_t kMostMaskedFloats = 23;

/// The parameter (RWRI byte of 08 1B) that stands at `offset` of the reply to `pdu`, when that is a
/// live float read, single or group; in group replies slot 0 is the sum, or repeats phase 1.
std::optional<std::uint8_t> ParameterAt(View pdu, std::size_t offset);

/// 0 is the lowest bit of the last mask byte. Nothing where the mask has no place for the
/// parameter.
std::optional<unsigned> MaskBit(std::uint8_t parameter);
std::optional<std::uint8_t> MaskedParameter(unsigned bit);

/// Whether the request is an 08 23.
bool IsMasked(View pdu);
/// The PDU that asks for these bits: 08 23 id 00 m1…m8.
Bytes MaskRequest(std::uint8_t id, const std::vector<unsigned>& bits);
/// The bits that a 08 23 PDU asks for, in the order of the reply's values.
std::vector<unsigned> MaskBits(View pdu);

}  // namespace baudgate::protocols::set4tm
