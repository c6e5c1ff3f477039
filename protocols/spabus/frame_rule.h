// Where messages of the SPA Bus begin and end: replies for the master, requests for twins.
// Bytes come from the line through protocols/assembler.h; whole frames go to the conversation or
// twin.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/frame_rule.h"

namespace baudgate::protocols::spabus {

/// Delivers `<` … CR [LF] with right syntax and a checksum that passes under expect.checksum
/// (reply.h). The LF before `<` and echoes of requests are dropped without blame.
Cut ReplyRule(View held, const Expectation& expect, bool idle);

/// Delivers every `>` … CR: a slave answers a damaged request with NACK 0, so the twin judges.
Cut RequestRule(View held, const Expectation& expect, bool idle);

}  // namespace baudgate::protocols::spabus
