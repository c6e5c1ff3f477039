// What may answer a request of the example.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/model/options.h"
#include "protocols/frame_rule.h"

namespace baudgate::protocols::example {

Expectation Expect(View request, const config::Options& options);

}  // namespace baudgate::protocols::example
