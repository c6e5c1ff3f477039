// What may answer a request on the SPA Bus, from the request's bytes and the device's options
// alone.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/frame_rule.h"
#include "protocols/spabus/settings.h"

namespace baudgate::protocols::spabus {

/// An empty request: what a twin listens for.
Expectation Expect(View request, const Settings& settings);

}  // namespace baudgate::protocols::spabus
