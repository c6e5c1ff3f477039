// What may answer a request on the SPA Bus, from the request's bytes and the device's options
// alone. RequestRule and ReplyRule say where messages begin and end, and Recognise what other bytes
// are; the tables for a scan and for telegrams by hand stand here too.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "gateway/base/bytes.h"
#include "protocols/frame_rule.h"
#include "protocols/protocol.h"
#include "protocols/scanning.h"
#include "protocols/spabus/settings.h"

namespace baudgate::protocols::spabus {

/// An empty request: what a twin listens for.
Expectation Expect(View request, const Settings& settings);

// Where messages of the SPA Bus begin and end: replies for the master, requests for twins.
// Bytes come from the line through protocols/assembler.h; whole frames go to the conversation or
// twin.

/// Delivers `<` … CR [LF] with right syntax and a checksum that passes under expect.checksum
/// (reply.h). The LF before `<` and echoes of requests are dropped without blame.
Cut ReplyRule(View held, const Expectation& expect, bool idle);

/// Delivers every `>` … CR: a slave answers a damaged request with NACK 0, so the twin judges.
Cut RequestRule(View held, const Expectation& expect, bool idle);

// What a scan asks on a bus that may be a SPA bus: `F`, who are you, with a real checksum and with
// XX. Nothing else. Goes to gateway/tools/scan through the descriptor.

extern const ScanRule kScan;

// What a person may send by hand: the check value in the place of XX, and which telegrams are reads
// for certain. `L` is none: it takes the events out of the relay.

extern const TelegramRule kTelegram;

// What bytes are that came in place of a SPA reply: another slave, another master.

std::optional<Recognised> Recognise(View request, View heard, const Settings& settings);

}  // namespace baudgate::protocols::spabus
