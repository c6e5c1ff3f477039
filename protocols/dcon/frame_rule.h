// Where DCON messages begin and end in the bytes that protocols/assembler.h holds.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/frame_rule.h"

namespace baudgate::protocols::dcon {

/// Requests: from one of $ # % @ ~ ^ to CR.
Cut RequestRule(View held, const Expectation& expect, bool idle);

/// Replies: from one of > ! ? to CR.
Cut ReplyRule(View held, const Expectation& expect, bool idle);

}  // namespace baudgate::protocols::dcon
