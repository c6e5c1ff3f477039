// The descriptor of DCON: what protocols/dcon/module.cpp exports and what tests link statically.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/protocol.h"

namespace baudgate::dcon {

const Protocol& DconProtocol();

/// What may answer `request` (protocols/dcon/README.md); no request: what a twin listens for.
Expectation Expect(View request, const config::Options& options);

}  // namespace baudgate::dcon
