// What a protocol puts on the wire, asked of the protocol itself: which addresses mean the same
// device. For checks of devices.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gateway/base/bytes.h"
#include "protocols/protocol.h"

namespace baudgate::config {

/// The request that asks whether a device at this address is there, with all options at their
/// defaults: the same for every spelling of one address. Empty where the protocol has none.
Bytes ProbeOf(const Protocol& protocol, const std::string& address);

}  // namespace baudgate::config
