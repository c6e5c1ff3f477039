// What may answer a SET-4TM request, from the request's bytes alone.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/frame_rule.h"
#include "protocols/set4tm/settings.h"

namespace baudgate::protocols::set4tm {

/// An empty request: what a twin listens for.
Expectation Expect(View request, const Settings& settings);

}  // namespace baudgate::protocols::set4tm
