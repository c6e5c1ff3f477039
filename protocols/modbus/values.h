// Registers to values and back, by the form and order of a place. Registers come from replies and
// the twin's image; values go to readings and to the twin's points.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/result.h"
#include "gateway/base/value.h"
#include "protocols/common/decoded.h"
#include "protocols/modbus/points.h"
#include "protocols/modbus/settings.h"

namespace baudgate::protocols::modbus {

using Registers = std::vector<std::uint16_t>;

/// The big-endian word at `at`; 0 where it is cut short.
inline std::uint16_t U16At(View bytes, std::size_t at) {
  return ByteReader(bytes).U16Be(at).value_or(0);
}
/// Big-endian words from `at` to the end.
Registers WordsFrom(View bytes, std::size_t at);

/// `registers`: those of the place and no others.
Decoded Decode(const Location& place, std::span<const std::uint16_t> registers,
               const Settings& settings);

/// `block`: the registers from BeginOf to EndOf, with that of the scale.
Decoded DecodeBlock(const Location& place, std::span<const std::uint16_t> block,
                    const Settings& settings, std::span<const config::Sentinel> sentinels);

/// All registers of the place; of Form::bit, Form::bits and Form::text see below. An error when the
/// value does not fit: nothing is ever cut or wrapped.
Result<Registers> Encode(const Location& place, const Value& value, const Settings& settings);

/// The code that means `value` in the place's text table.
std::optional<std::uint16_t> CodeOf(const Location& place, const Value& value,
                                    const Settings& settings);

}  // namespace baudgate::protocols::modbus
