// What may answer a Modbus request, and how transparent routes carry PDUs over a serial line: both
// follow from the request's bytes alone, in every framing.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "protocols/modbus/codec.h"
#include "protocols/protocol.h"

namespace baudgate::protocols::modbus {

/// Expectation::address holds the slave's number, whatever its form on the wire.
Expectation Expect(Framing framing, View request);

/// Shape::tag: the function code of the reply, and of tcp its transaction.
constexpr int TagOf(std::uint16_t transaction, int function) {
  return transaction * 256 + function;
}
constexpr std::uint16_t TransactionOf(int tag) { return static_cast<std::uint16_t>(tag / 256); }

/// Null: routes to TCP servers do without a line (docs/modbus.md).
const PduCarrier* Carrier(Framing framing);

}  // namespace baudgate::protocols::modbus
