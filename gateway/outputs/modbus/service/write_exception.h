// The exception that a client of a Modbus server is answered when its write has failed. Pure.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/bus/writes/write_command.h"
#include "gateway/bus/writes/write_gate.h"
#include "gateway/outputs/modbus/wire/request.h"

namespace baudgate::modbus {

/// kNoException: it ended well.
ExceptionCode ExceptionOf(const WriteResult& result);
/// Why it was not begun.
ExceptionCode ExceptionOf(const WriteDenial& denial);

}  // namespace baudgate::modbus
