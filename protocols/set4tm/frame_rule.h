// Where SET-4TM requests and replies begin and end in the bytes of a line: pure functions that the
// frame assembler calls.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/frame_rule.h"

namespace baudgate::protocols::set4tm {

/// Tags of the shapes of a reply. A short request may be answered with the extended address when
/// the meter is set so (reference, chapter 2), so an expectation lists both forms.
enum ReplyTag : int { kShortForm = 1, kExtendedForm = 2 };

Cut RequestRule(View held, const Expectation& expect, bool idle);
Cut ReplyRule(View held, const Expectation& expect, bool idle);

}  // namespace baudgate::protocols::set4tm
