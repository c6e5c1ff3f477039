// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/fast/interface_watch.h"

#include <algorithm>

#include "gateway/outputs/dds/fast/participant.h"

namespace baudgate::dds {

bool InterfaceWatch::Uses(const std::string& address) const {
  return MeansAll(interfaces_) || std::ranges::count(interfaces_, address) > 0;
}

std::optional<std::string> InterfaceWatch::Gone(const OwnAddresses& now) const {
  const auto is_here = [&now](const std::string& address) { return IsOwn(now, address); };
  if (MeansAll(interfaces_) || std::ranges::none_of(interfaces_, is_here)) return std::nullopt;
  const auto gone = std::ranges::find_if(interfaces_, [&](const std::string& address) {
    return own_.contains(address) && !is_here(address);
  });
  if (gone == interfaces_.end()) return std::nullopt;
  return "this machine no longer has the address " + *gone;
}

std::optional<std::string> InterfaceWatch::Look(const OwnAddresses& now) const {
  for (const auto& [address, index] : now) {
    if (!index || !Uses(address)) continue;
    const auto was = own_.find(address);
    if (was == own_.end()) return "this machine has a new address, " + address;
    if (!was->second) return "the interface of " + address + " is up now";
    if (was->second != index) return "the interface of " + address + " was made anew";
  }
  return Gone(now);
}

}  // namespace baudgate::dds
