// What the clients of a listener may ask for: its `permit`. Whether a point can be written at all
// is gateway/bus/writes/write_gate.h's affair.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "config/model/listener.h"

namespace baudgate::modbus {

/// Whether clients with this permission may ask for the function code.
bool Permits(config::Permit permit, std::uint8_t function);

}  // namespace baudgate::modbus
