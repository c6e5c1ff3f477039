// The descriptor of the SPA Bus plugin: options, addresses, timing, and where everything is made.
// The daemon takes it from the loadable module, tests and fuzzers from here.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/protocol.h"

namespace baudgate {

const Protocol& SpabusProtocol();

}  // namespace baudgate
