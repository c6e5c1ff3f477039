// What a client's registers (value_registers.h) mean: values of points, as users see them, or the
// selection of one. gateway/outputs/modbus/service/unit_writer.cpp takes them to
// gateway/bus/writes/write_gate.h. Pure.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "config/model/device.h"
#include "gateway/bus/writes/write_gate.h"
#include "gateway/outputs/modbus/registers/register_map.h"
#include "gateway/outputs/modbus/wire/request.h"

namespace baudgate::modbus {

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
