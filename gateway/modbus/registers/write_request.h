// The one conversion and the one check of a write: registers (value_registers.h) → value → raw
// value (ToRaw of gateway/store/conversion.h), which point_desk.cpp puts into the queue of the
// device's line. What is refused here is answered at once, and nothing of the request is sent.
// Pure.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "config/model/device.h"
#include "gateway/modbus/registers/register_map.h"
#include "gateway/modbus/wire/request.h"
#include "gateway/requests/commands.h"

namespace baudgate::modbus {

struct Writes {
  ExceptionCode exception = kNoException;
  std::vector<PointWrite> writes;  ///< empty where there is an exception
};

/// illegal_address: not mapped or read-only. illegal_value: part of a value, or a number that the
/// type or the device can not hold.
Writes ConvertWrites(const UnitMap& unit, const config::Device& device,
                     const ModbusRequest& request);

}  // namespace baudgate::modbus
