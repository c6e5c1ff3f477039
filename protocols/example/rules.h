// `Expect` returns the expected replies to a request of the example. RequestRule and ReplyRule are
// its frame rules.
#pragma once

#include "protocols/frame_rule.h"

namespace baudgate::protocols::example {

/// Returns which replies can answer `request`. For an empty request it returns the limits of
/// request frames, which simulated devices (twins) need.
Expectation Expect(View request);

Cut RequestRule(View held, const Expectation& expect, bool idle);
Cut ReplyRule(View held, const Expectation& expect, bool idle);

}  // namespace baudgate::protocols::example
