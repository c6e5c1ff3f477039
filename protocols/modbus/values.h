// Converts registers to values and back, by the form and word order of a location.
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

inline std::uint16_t U16At(View bytes, std::size_t at) {
  return ByteReader(bytes).U16Be(at).value_or(0);
}
/// Returns the big-endian words of `bytes` from offset `at` to the end.
Registers WordsFrom(View bytes, std::size_t at);

/// Decodes a value. `registers`: exactly the registers of the location, without its scale register.
Decoded Decode(const Location& place, std::span<const std::uint16_t> registers,
               const Settings& settings);

/// Decodes and scales a value. `block`: the registers from BeginOf to EndOf, with the scale
/// register.
Decoded DecodeBlock(const Location& place, std::span<const std::uint16_t> block,
                    const Settings& settings, std::span<const config::Sentinel> sentinels);

/// Returns the registers of the location for `value`, or an error if the value does not fit: no
/// value is clamped or wrapped. Must not be called for Form::bit, Form::bits and Form::text (use
/// CodeOf).
Result<Registers> Encode(const Location& place, const Value& value, const Settings& settings);

/// Returns the code of the text `value` in the location's text table, or nothing.
std::optional<std::uint16_t> CodeOf(const Location& place, const Value& value,
                                    const Settings& settings);

}  // namespace baudgate::protocols::modbus
