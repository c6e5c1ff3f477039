// Turns a checked write request into the values that a device is to be given; pure.
// Requests come from request.h, the values go to the device's line through point_desk.cpp.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "config/model/device.h"
#include "gateway/modbus/registers/register_map.h"
#include "gateway/modbus/wire/request.h"
#include "gateway/requests/commands.h"

namespace baudgate::modbus {

/// illegal_address: not mapped or read-only. illegal_value: part of a value, or a number that the
/// type does not allow.
ExceptionCode DecodeWrites(const UnitMap& unit, const config::Device& device,
                           const ModbusRequest& request, std::vector<PointWrite>& writes);

}  // namespace baudgate::modbus
