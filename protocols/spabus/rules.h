// Rules for messages of the SPA Bus: `Expect` lists the possible replies, by the bytes of a request
// and the device's options; `ReplyRule` and `RequestRule` cut messages out of a byte stream;
// `Recognise` explains other bytes. The tables for a scan and for telegrams by hand are here, too.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "gateway/base/bytes.h"
#include "protocols/frame_rule.h"
#include "protocols/protocol.h"
#include "protocols/scanning.h"
#include "protocols/spabus/settings.h"

namespace baudgate::protocols::spabus {

/// Returns the possible replies. An empty request stands for the twin, which expects requests.
Expectation Expect(View request, const Settings& settings);

// Cut messages out of received bytes: replies for the master, requests for twins.

/// Delivers `<` … CR [LF] with right syntax and a checksum that is right under expect.checksum
/// (reply.h). The LF before `<` and echoes of requests are dropped and not counted as damage.
Cut ReplyRule(View held, const Expectation& expect, bool idle);

/// Delivers every `>` … CR, even with a wrong checksum, because a slave answers it with NACK 0.
Cut RequestRule(View held, const Expectation& expect, bool idle);

// The requests of a scan on a bus that may be a SPA bus: only `F` (type designation), with a real
// checksum and with XX.

extern const ScanRule kScan;

// Telegrams by hand: completes the check value, in place of XX if it is there, and decides which
// telegrams are certainly reads. `L` is no read, because it takes the events out of the relay.

extern const TelegramRule kTelegram;

// Explains bytes that came in place of a reply: another slave, another master, another option.

std::optional<Recognised> Recognise(View request, View heard, const Settings& settings);

}  // namespace baudgate::protocols::spabus
