// Which clients may connect, and with which priority: `allow` and `clients` of a listener. Pure.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "config/model/listener.h"

namespace baudgate::modbus {

/// An IPv6 address, or an IPv4 one in its mapped form (::ffff:a.b.c.d).
using PeerAddress = std::array<std::uint8_t, 16>;

bool Contains(const config::Network& network, const PeerAddress& peer);

/// An empty list allows everybody.
bool Allows(std::span<const config::Network> list, const PeerAddress& peer);

/// The priority of the first client rule that fits, else the listener's.
config::Priority PriorityOf(const config::Listener& listener, const PeerAddress& peer);

}  // namespace baudgate::modbus
