// What a person may send by hand: the check value behind text and bytes that have none, and which
// telegrams are reads for certain.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/modbus/codec.h"
#include "protocols/protocol.h"

namespace baudgate::protocols::modbus {

/// Null: nothing, as over TCP, where a header counts the requests.
const TelegramRule* TelegramOf(Framing framing);

}  // namespace baudgate::protocols::modbus
