// What `baudgate check` says of Modbus listeners.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <ostream>

#include "config/model/outputs.h"

namespace baudgate {

void PrintListener(const config::Listener& listener, std::ostream& out);
nlohmann::ordered_json ModbusJson(const config::Modbus& modbus);

}  // namespace baudgate
