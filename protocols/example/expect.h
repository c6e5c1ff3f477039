// What may answer a request of the example.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/frame_rule.h"

namespace baudgate::protocols::example {

/// An empty request: what a twin listens for.
Expectation Expect(View request);

}  // namespace baudgate::protocols::example
