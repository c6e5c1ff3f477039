// Turns a checked write request into the values that a device is to be given; pure.
// Requests come from request.h, the values go to the device's line through service.cpp.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "config/config.h"
#include "gateway/commands.h"
#include "gateway/modbus/register_map.h"
#include "gateway/modbus/request.h"

namespace baudgate::modbus {

/// illegal_address: not mapped or read-only. illegal_value: part of a value, or a number that the
/// type does not allow.
ExceptionCode DecodeWrites(const UnitMap& unit, const config::Device& device,
                           const ModbusRequest& request, std::vector<PointWrite>& writes);

}  // namespace baudgate::modbus
