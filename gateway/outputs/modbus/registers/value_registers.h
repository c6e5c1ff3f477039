// How a value looks in 16-bit registers or in a bit, and what stands there when it cannot be
// trusted. Pure. Values come from the point store (register_contents.cpp) or from a
// client: ConvertWrites gives what its registers mean.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "config/model/device.h"
#include "gateway/base/value.h"
#include "gateway/bus/writes/write_gate.h"
#include "gateway/outputs/modbus/registers/register_map.h"
#include "gateway/outputs/modbus/wire/request.h"

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

// What a client's registers mean: values of points, as users see them, or the
// selection of one. gateway/outputs/modbus/service/own_units.cpp takes them to
// gateway/bus/writes/write_gate.h. Pure.
struct ConvertedWrite {
  ExceptionCode exception = kNoException;
  std::vector<WriteAsk::Part> parts{};  ///< empty where there is an exception
};

/// The point that the request selects; empty: it is no selection. Whether it has the key is
/// IsSelectKey.
std::optional<std::uint32_t> SelectedPoint(const UnitMap& unit, const ModbusRequest& request);
bool IsSelectKey(const ModbusRequest& request);

/// The request is for where a unit shows its events from (config::kEventBlock), and nothing else.
bool IsFirstEvent(const ModbusRequest& request);
/// Empty: it is half of it.
std::optional<std::uint32_t> FirstEvent(const ModbusRequest& request);

/// kIllegalAddress: not mapped. kIllegalValue: part of a value, or a number that the
/// type cannot hold.
ConvertedWrite ConvertWrites(const UnitMap& unit, const config::Device& device,
                             const ModbusRequest& request);

}  // namespace baudgate::modbus
