// SPDX-License-Identifier: Apache-2.0
#include "gateway/dds/fast/interface_watch.h"

#include <algorithm>

#include "gateway/dds/fast/participant.h"

namespace baudgate::dds {

bool InterfaceWatch::Uses(const std::string& address) const {
  return MeansAll(interfaces_) || std::ranges::count(interfaces_, address) > 0;
}

std::optional<std::string> InterfaceWatch::Look(const OwnAddresses& now) const {
  for (const auto& [address, index] : now) {
    if (!index || !Uses(address)) continue;
    const auto was = own_.find(address);
    if (was == own_.end()) return "this machine has a new address, " + address;
    if (!was->second) return "the interface of " + address + " is up now";
    if (was->second != index) return "the interface of " + address + " was made anew";
  }
  return std::nullopt;
}

}  // namespace baudgate::dds
