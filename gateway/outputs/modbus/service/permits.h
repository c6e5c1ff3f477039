// `Permits` tells whether a client may send a request: by `permit` of a listener, and by the role
// in the certificate of the client. `HasExactForm` finds requests whose lengths do not fit each
// other.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "config/model/outputs.h"
#include "gateway/base/bytes.h"

namespace baudgate::modbus {

/// True if clients with this permission are allowed to use the function code.
/// gateway/bus/writes/write_gate.h decides which points can be written.
bool Permits(config::Permit permit, std::uint8_t function);

/// True if a role with these rights is allowed to send the request. A rule with `addresses` permits
/// only functions whose requests contain addresses of registers or bits.
bool Permits(const config::RoleRights& rights, View frame);

/// True if the lengths in a request fit each other, or its function has no known form. A slave
/// could take additional bytes for a request of their own. Source: MODBUS Application Protocol
/// 1.1b3, chapter 6.
bool HasExactForm(View frame);

}  // namespace baudgate::modbus
