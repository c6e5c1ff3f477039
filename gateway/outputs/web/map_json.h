// Where the points of a device stand on Modbus.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>

#include "config/model/device.h"

namespace baudgate::web {

/// {"unit":1,"registers":[{"point":"current_l1","table":"holding","address":0,"count":2,…}]}. The
/// unit is null where the device is not on Modbus.
nlohmann::ordered_json MapJson(const config::Device& device);

}  // namespace baudgate::web
