// Rules for messages of the SPA Bus: `Expect` returns the possible replies, by the bytes of a
// request and the device's options; `ReplyRule` and `RequestRule` cut messages out of a byte
// stream; `Recognise` explains other bytes. kScan and kTelegram are the tables for a scan and for
// telegrams typed by hand.
#pragma once

#include <optional>

#include "gateway/base/bytes.h"
#include "protocols/frame_rule.h"
#include "protocols/protocol.h"
#include "protocols/scanning.h"
#include "protocols/spabus/settings.h"

namespace baudgate::protocols::spabus {

/// Returns which replies can answer `request`. If `request` is empty, returns what requests look
/// like, which a simulated device (twin) needs.
Expectation Expect(View request, const Settings& settings);

/// Cuts replies, `<` … CR [LF], that have right syntax and a checksum that is right under
/// expect.checksum (kCovers…). The LF before `<` and echoes of requests are dropped and not counted
/// as damage.
Cut ReplyRule(View held, const Expectation& expect, bool idle);

/// Cuts requests, `>` … CR, for simulated devices (twins). A wrong checksum is accepted, because a
/// slave answers it with NACK 0.
Cut RequestRule(View held, const Expectation& expect, bool idle);

// The requests of a scan on an unknown bus: only `F` (type designation), with a real checksum and
// with XX.

extern const ScanRule kScan;

// The rule for telegrams typed by hand. It adds a checksum that is missing or XX, and decides which
// telegrams are certainly reads. `L` is not a read, because it takes events out of the relay.

extern const TelegramRule kTelegram;

// Explains bytes that came in place of a reply: another slave, another master, or another option.

std::optional<Recognised> Recognise(View request, View heard, const Settings& settings);

}  // namespace baudgate::protocols::spabus
