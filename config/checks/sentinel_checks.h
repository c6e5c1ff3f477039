// Whether a point's `sentinels` can ever come: those of a protocol's whole numbers lie within the
// range of what is read, and in hex they are its bits.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/model/device.h"
#include "config/model/problem.h"
#include "protocols/protocol.h"

namespace baudgate::config {

/// 0x8000 of an int16 becomes -32768, whatever the point's own type is. Without a protocol that
/// type decides. Errors: what the device can never send, and what stands twice.
void ResolveSentinels(Device& device, const Protocol* protocol, Problems& problems);

}  // namespace baudgate::config
