// `Expect` gives the expected replies to a request of the example. RequestRule and ReplyRule are
// its frame rules.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/frame_rule.h"

namespace baudgate::protocols::example {

/// An empty request gives the expectation for requests, which twins use.
Expectation Expect(View request);

Cut RequestRule(View held, const Expectation& expect, bool idle);
Cut ReplyRule(View held, const Expectation& expect, bool idle);

}  // namespace baudgate::protocols::example
