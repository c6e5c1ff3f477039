// What may answer a SET-4TM request, from the request's bytes alone. RequestRule and ReplyRule say
// where messages begin and end, and Recognise what other bytes are; the tables for a scan and for
// telegrams by hand stand here too.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "gateway/base/bytes.h"
#include "protocols/frame_rule.h"
#include "protocols/protocol.h"
#include "protocols/scanning.h"
#include "protocols/set4tm/meter/settings.h"

namespace baudgate::protocols::set4tm {

/// An empty request: what a twin listens for.
Expectation Expect(View request, const Settings& settings);

// Where SET-4TM requests and replies begin and end in the bytes of a line: pure functions that the
// frame assembler calls.

/// Tags of the shapes of a reply. A short request may be answered with the extended address when
/// the meter is set so (reference, chapter 2), so an expectation lists both forms.
enum ReplyTag : int { kShortForm = 1, kExtendedForm = 2 };

Cut RequestRule(View held, const Expectation& expect, bool idle);
Cut ReplyRule(View held, const Expectation& expect, bool idle);

// What a scan asks on a bus that may be one of SET-4TM meters: the link test, whose reply looks
// like its echo, and the serial number, which proves that somebody has answered; a meter says it
// only where its channel is open. Nothing else. Goes to gateway/tools/scan through the descriptor.

extern const ScanRule kScan;

// What a person may send by hand: the check value behind bytes that have none, and which telegrams
// are reads for certain. Opening the channel is none: it carries the password.

extern const TelegramRule kTelegram;

// What bytes are that came in place of a reply of a meter: another check value, another meter.

std::optional<Recognised> Recognise(View request, View heard, const Settings& settings);

}  // namespace baudgate::protocols::set4tm
