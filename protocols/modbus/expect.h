// What may answer a Modbus request, and how transparent routes carry PDUs over a serial line: both
// follow from the request's bytes alone, in either framing.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/modbus/codec.h"
#include "protocols/protocol.h"

namespace baudgate::protocols::modbus {

/// Expectation::address holds the slave's number, whatever its form on the wire.
Expectation Expect(Framing framing, View request);

const PduCarrier& Carrier(Framing framing);

}  // namespace baudgate::protocols::modbus
