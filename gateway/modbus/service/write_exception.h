// The exception that a client of a Modbus server is answered when its write has failed. Pure.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/modbus/wire/request.h"
#include "gateway/requests/write_command.h"
#include "gateway/writes/write_gate.h"

namespace baudgate::modbus {

/// kNoException: it ended well.
ExceptionCode ExceptionOf(const WriteResult& result);
/// Why it was not begun.
ExceptionCode ExceptionOf(const WriteDenial& denial);

}  // namespace baudgate::modbus
