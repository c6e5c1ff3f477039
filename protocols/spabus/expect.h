// What may answer a request on the SPA Bus, from the request's bytes and the device's options
// alone.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/model/options.h"
#include "protocols/frame_rule.h"

namespace baudgate::protocols::spabus {

/// An empty request: what a twin listens for.
Expectation Expect(View request, const config::Options& options);

}  // namespace baudgate::protocols::spabus
