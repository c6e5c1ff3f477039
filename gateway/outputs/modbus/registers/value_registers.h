// How a value looks in 16-bit registers or in a bit, and what stands there when it cannot be
// trusted. Pure. Values come from the point store (register_contents.cpp) or from a client
// (write_request.cpp).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "config/model/device.h"
#include "gateway/base/quality.h"
#include "gateway/base/value.h"

namespace baudgate::modbus {

/// What a client is shown in place of a value.
enum class Shown : std::uint8_t {
  held,        ///< the last good value
  no_value,    ///< EncodeNoValue
  substitute,  ///< the point's on_fault VALUE
  exception,   ///< 0x0B for the whole request
};

/// The rules of `on_bad` and `on_fault`. `held`: there is a last good value, and it fits the
/// registers.
///  * Good and uncertain values are shown.
///  * Faults of one channel (0x04, 0x0C, 0x10) never raise an exception: on_fault counts, by
///    default nan for floats and hold for all others.
///  * Everything else that is bad follows on_bad. `hold` before the first value is an exception: a
///    made-up 0 must not pass for a reading. `nan` is for floats and texts; an integer or a bit has
///    no such number, so it is an exception unless on_fault names a VALUE.
Shown Show(const config::Point& point, config::OnBad on_bad, Quality quality, bool held);

/// Fills `out` (RegisterCount(point) registers). False, with nothing written, when the value does
/// not fit the type: too large, not a number, or missing. Texts are cut at the point's length.
bool EncodeRegisters(const config::Point& point, config::WordOrder order, const Value& value,
                     std::span<std::uint16_t> out);

/// NaN for floats, an empty text, and for integers the most unlikely number of the type (as SunSpec
/// has it): the smallest of a signed one, all bits set of an unsigned one; 0 for a bool.
void EncodeNoValue(const config::Point& point, config::WordOrder order,
                   std::span<std::uint16_t> out);

/// Nothing when the value is neither a number nor a boolean.
std::optional<bool> EncodeBit(const Value& value);

/// A client's registers as a value of the point's type. Nothing for a float that is no number, a
/// bool other than 0 and 1, or a wrong register count.
std::optional<Value> DecodeRegisters(const config::Point& point, config::WordOrder order,
                                     std::span<const std::uint16_t> registers);

}  // namespace baudgate::modbus
