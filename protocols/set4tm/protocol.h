// The descriptor of the SET-4TM protocol, for the module, for tests and for fuzzers.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/protocol.h"

namespace baudgate {

const Protocol& Set4tmProtocol();

}  // namespace baudgate
