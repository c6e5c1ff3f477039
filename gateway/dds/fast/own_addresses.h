// The IPv4 addresses of this machine, asked of the system each time: interfaces come and go.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

namespace baudgate::dds {

/// By address in dotted form, the index of its interface. An interface that is deleted and made
/// anew with the same address has another index.
using OwnAddresses = std::map<std::string, unsigned>;

/// Empty as well where the system does not tell.
OwnAddresses FindOwnAddresses();

/// All of 127/8 is ours, although the interface lists 127.0.0.1 only.
bool IsOwn(const OwnAddresses& own, const std::string& address);

}  // namespace baudgate::dds
