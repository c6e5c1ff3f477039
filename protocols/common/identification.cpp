// SPDX-License-Identifier: Apache-2.0
#include "protocols/common/identification.h"

#include <algorithm>
#include <string>
#include <utility>

#include "gateway/base/text.h"

namespace baudgate::protocols {
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
    return {Reason::other_module,
            "the device does not match its profile, because it reports the name '" + shown +
                "'; set profile: " + other->second + ", or correct the address"};
  }
  return {Reason::none, "it reports the name '" + shown + "', which its profile does not list (" +
                            Listed(identity.names) +
                            "), but its values are still used; correct the address or the profile, "
                            "or set identity: ignore"};
}

namespace {

constexpr int kSilencesOfAnUnknownRequest = 3;

}  // namespace

bool ProbeChoice::GivenUp() const {
  return own_ == Own::none || (!own_answered_ && silences_ >= kSilencesOfAnUnknownRequest);
}

std::optional<std::size_t> ProbeChoice::Next(std::size_t reads, std::size_t best) const {
  if (reads == 0 || (own_ == Own::read && own_answered_)) return std::nullopt;
  if (failed_ % 2 == 1) return (failed_ + 1) / 2 % reads;
  return GivenUp() ? std::optional(best) : std::nullopt;
}

void ProbeChoice::OnAnswered(bool own) {
  // The answer to a read may be the late answer to an earlier request. So if this device has
  // answered its own probe before, an answered read counts as a failure, and the own probe is sent
  // next.
  failed_ = own || !own_answered_ ? 0 : failed_ + 1;
  if (own) {
    silences_ = 0;
    own_unanswered_ = false;
    own_answered_ = true;
  } else if (std::exchange(own_unanswered_, false)) {
    ++silences_;
  }
}

bool ProbeChoice::OnFailed(bool own) {
  ++failed_;
  if (own) own_unanswered_ = true;
  return own && !own_answered_ && failed_ == 1;
}

void ProbeChoice::OnReconnect() {
  own_unanswered_ = false;
  silences_ = std::min(silences_, kSilencesOfAnUnknownRequest - 1);
}

}  // namespace baudgate::protocols
