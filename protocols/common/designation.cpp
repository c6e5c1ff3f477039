// SPDX-License-Identifier: Apache-2.0
#include "protocols/common/designation.h"

#include <algorithm>
#include <string>

#include "gateway/base/text.h"

namespace baudgate {
namespace {

std::string Listed(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text.append(text.empty() ? "" : ", ").append(name);
  return text;
}

}  // namespace

DeviceTrouble JudgeName(const config::Identity& identity, std::string_view says) {
  const std::string spoken = config::SpokenName(says);
  const bool own = std::ranges::any_of(
      identity.names, [&](const std::string& name) { return config::SpokenName(name) == spoken; });
  if (own || spoken.empty() || identity.names.empty() || identity.ignore) return {};
  const std::string shown = Printable(ToBytes(Trim(says)));
  if (const auto other = identity.others.find(spoken); other != identity.others.end()) {
    return {Reason::other_module, "the device is not what its profile says: it calls itself '" +
                                      shown + "': set profile: " + other->second +
                                      ", or correct its address"};
  }
  return {Reason::none, "it calls itself '" + shown + "', which its profile does not list (" +
                            Listed(identity.names) +
                            "); its values are served all the same: correct its address or "
                            "profile, or set identity: ignore"};
}

}  // namespace baudgate
