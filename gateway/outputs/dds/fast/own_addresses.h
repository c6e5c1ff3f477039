// The IPv4 addresses of this machine, asked of the system each time: interfaces come and go.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>

namespace baudgate::dds {

/// By address in dotted form, the index of its interface; nothing while that is down or its cable
/// is unplugged: Fast DDS then leaves the address out. An interface that is deleted and made again
/// with the same address has another index.
using OwnAddresses = std::map<std::string, std::optional<unsigned>>;

/// Empty as well where the system does not tell.
OwnAddresses FindOwnAddresses();

/// All of 127/8 is ours, although the interface lists 127.0.0.1 only.
bool IsOwn(const OwnAddresses& own, const std::string& address);

/// Why nothing can be sent from an address now; empty: it can.
std::optional<std::string> WhyUnused(const OwnAddresses& own, const std::string& address);

}  // namespace baudgate::dds
