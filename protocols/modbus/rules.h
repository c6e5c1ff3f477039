// Rules of Modbus frames, in every framing. Expect returns which replies can answer a request; the
// request and reply rules find where messages begin and end; Carrier serves transparent routes over
// a serial line, ScanOf a scan, and TelegramOf telegrams typed by hand.
#pragma once

#include <cstdint>

#include "protocols/frame_rule.h"
#include "protocols/modbus/codec.h"
#include "protocols/protocol.h"
#include "protocols/scanning.h"

namespace baudgate::protocols::modbus {

/// Returns which replies can answer `request`. In every framing Expectation::address is one byte,
/// the slave number, also if the frames contain the number in hex digits.
Expectation Expect(Framing framing, View request);

/// Returns the value of Shape::tag for a reply: its function code, and for tcp its transaction as
/// well.
constexpr int TagOf(std::uint16_t transaction, int function) {
  return transaction * 256 + function;
}
constexpr std::uint16_t TransactionOf(int tag) { return static_cast<std::uint16_t>(tag / 256); }

/// Returns the functions for transparent routes; null for tcp, because routes to TCP servers do not
/// use a line (docs/modbus.md).
const PduCarrier* Carrier(Framing framing);

Cut RtuRequestRule(View held, const Expectation& expect, bool idle);
Cut RtuReplyRule(View held, const Expectation& expect, bool idle);

/// Cuts ASCII requests. On a bus with several devices it also cuts replies, which have the same
/// form.
Cut AsciiRequestRule(View held, const Expectation& expect, bool idle);
Cut AsciiReplyRule(View held, const Expectation& expect, bool idle);

Cut TcpRequestRule(View held, const Expectation& expect, bool idle);
Cut TcpReplyRule(View held, const Expectation& expect, bool idle);

// The requests of a scan: only server id (17), identification (43/14), loopback (8), and then a
// read of one register. gateway/tools/scan uses this rule.

/// Returns the rule for scans; null for tcp, because a scan searches serial lines only.
const ScanRule* ScanOf(Framing framing);

// The rule for telegrams typed by hand: adds a missing check value, and decides which are reads.

/// Returns the rule for telegrams typed by hand; null for tcp: a frame needs a transaction number,
/// which nobody types.
const TelegramRule* TelegramOf(Framing framing);

}  // namespace baudgate::protocols::modbus
