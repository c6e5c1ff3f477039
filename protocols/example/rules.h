// What may answer a request of the example. RequestRule and ReplyRule say where messages begin and
// end.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/frame_rule.h"

namespace baudgate::protocols::example {

/// An empty request: what a twin listens for.
Expectation Expect(View request);

// Where requests and replies of the example begin and end.

Cut RequestRule(View held, const Expectation& expect, bool idle);
Cut ReplyRule(View held, const Expectation& expect, bool idle);

}  // namespace baudgate::protocols::example
