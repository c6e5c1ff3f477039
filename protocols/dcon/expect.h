// What may answer a DCON request, from the request's bytes and the device's options alone.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/model/options.h"
#include "protocols/dcon/settings.h"
#include "protocols/frame_rule.h"

namespace baudgate::protocols::dcon {

/// An empty request: what a twin listens for.
Expectation Expect(View request, const Settings& settings);

}  // namespace baudgate::protocols::dcon
