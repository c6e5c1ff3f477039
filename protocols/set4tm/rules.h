// Rules of SET-4TM frames. Expect returns which replies can answer a request, RequestRule and
// ReplyRule find where messages begin and end, and Recognise explains other bytes. kScan and
// kTelegram are the rules for scans and for telegrams typed by hand.
#pragma once

#include <optional>

#include "gateway/base/bytes.h"
#include "protocols/frame_rule.h"
#include "protocols/protocol.h"
#include "protocols/scanning.h"
#include "protocols/set4tm/meter/settings.h"

namespace baudgate::protocols::set4tm {

/// Returns which replies can answer `request`. If `request` is empty, returns what requests look
/// like, which a simulated device (twin) needs.
Expectation Expect(View request, const Settings& settings);

// RequestRule and ReplyRule cut requests and replies out of the bytes of a line, for the frame
// assembler. They have no state.

/// The values of Shape::tag. A meter can be set to answer a request to its short address with its
/// extended address (reference, chapter 2), so an expectation contains both forms.
enum ReplyTag : int { kShortForm = 1, kExtendedForm = 2 };

Cut RequestRule(View held, const Expectation& expect, bool idle);
Cut ReplyRule(View held, const Expectation& expect, bool idle);

// The requests of a scan: only the link test, whose reply equals its echo, and the serial number,
// which proves that a meter has answered. A meter returns its serial number only if its channel is
// open.

extern const ScanRule kScan;

// The rule for telegrams typed by hand: it adds a missing check value, and decides which telegrams
// are certainly reads. The opening of the channel is not a read, because it contains the password.

extern const TelegramRule kTelegram;

// Explains bytes that came in place of a reply: another check value, another meter or another
// master.

std::optional<Recognised> Recognise(View request, View heard, const Settings& settings);

}  // namespace baudgate::protocols::set4tm
