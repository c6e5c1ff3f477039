// Rules of SET-4TM frames. Expect returns which replies may answer a request, RequestRule and
// ReplyRule find where messages begin and end, and Recognise explains other bytes. The rules for
// scans and for telegrams typed by hand are here too.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "gateway/base/bytes.h"
#include "protocols/frame_rule.h"
#include "protocols/protocol.h"
#include "protocols/scanning.h"
#include "protocols/set4tm/meter/settings.h"

namespace baudgate::protocols::set4tm {

/// Returns which reply may answer `request`. For an empty request: what requests look like (twins).
Expectation Expect(View request, const Settings& settings);

// Pure functions that cut requests and replies out of the bytes of a line, for the frame assembler.

/// Shape::tag of a reply. A request to a short address may be answered with the extended address,
/// if the meter is set so (reference, chapter 2), so an expectation contains both forms.
enum ReplyTag : int { kShortForm = 1, kExtendedForm = 2 };

Cut RequestRule(View held, const Expectation& expect, bool idle);
Cut ReplyRule(View held, const Expectation& expect, bool idle);

// The requests of a scan: only the link test, whose reply equals its echo, and the serial number,
// which proves that a meter has answered. A meter returns it only if its channel is open.

extern const ScanRule kScan;

// The rule for telegrams typed by hand: adds a missing check value, and tells which telegrams are
// certainly reads. The opening of the channel is no read, because it contains the password.

extern const TelegramRule kTelegram;

// Explains bytes that came in place of a reply: another check value, meter or master.

std::optional<Recognised> Recognise(View request, View heard, const Settings& settings);

}  // namespace baudgate::protocols::set4tm
