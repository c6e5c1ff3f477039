// What may answer a Modbus request, and how transparent routes carry PDUs over a serial line: both
// follow from the request's bytes alone, in every framing. RtuReplyRule, AsciiReplyRule,
// TcpReplyRule and their request rules say where messages begin and end; ScanOf and TelegramOf
// serve a scan and telegrams by hand.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "protocols/frame_rule.h"
#include "protocols/modbus/codec.h"
#include "protocols/protocol.h"
#include "protocols/scanning.h"

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

// Where Modbus RTU messages begin and end in the bytes that protocols/assembler.h holds.

Cut RtuRequestRule(View held, const Expectation& expect, bool idle);
Cut RtuReplyRule(View held, const Expectation& expect, bool idle);

// Where Modbus ASCII messages begin and end in the bytes that protocols/assembler.h holds.

/// Requests and, on a bus with several devices, their replies: they look alike.
Cut AsciiRequestRule(View held, const Expectation& expect, bool idle);
Cut AsciiReplyRule(View held, const Expectation& expect, bool idle);

// Where Modbus TCP messages begin and end in the bytes that protocols/assembler.h holds.

Cut TcpRequestRule(View held, const Expectation& expect, bool idle);
Cut TcpReplyRule(View held, const Expectation& expect, bool idle);

// What a scan asks on a bus that may be one of Modbus slaves: server id (17), identification
// (43/14), loopback (8), then one read of one register. Nothing else. Goes to gateway/tools/scan
// through the descriptors.

/// Null: not looked for, as units behind TCP.
const ScanRule* ScanOf(Framing framing);

// What a person may send by hand: the check value behind text and bytes that have none, and which
// telegrams are reads for certain.

/// Null: nothing, as over TCP, where a header counts the requests.
const TelegramRule* TelegramOf(Framing framing);

}  // namespace baudgate::protocols::modbus
