// The descriptor of DCON: what protocols/dcon/module.cpp exports and what tests link statically.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/protocol.h"

namespace baudgate {

const Protocol& DconProtocol();

}  // namespace baudgate
