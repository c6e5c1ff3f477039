// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/reload/probation.h"

#include <algorithm>

#include "gateway/base/time.h"

namespace baudgate::reload {

void Probation::Begin(Instant now, Duration time, const Healths& before) {
  until_ = now + time;
  patience_ = std::min(kTimeToAnswer, time / 2);
  for (const auto& [device, health] : before) {
    if (health == Health::well) well_.try_emplace(device);
  }
  for (auto& [device, seen] : well_) seen = now;
}

void Probation::End() {
  until_.reset();
  well_.clear();
}

std::optional<std::string> Probation::Look(Instant now, const Healths& healths) {
  if (!until_) return std::nullopt;
  for (auto& [device, seen] : well_) {
    const auto found = healths.find(device);
    if (found == healths.end()) continue;
    if (found->second == Health::ill) return device + " worked before, and does not any more";
    if (found->second != Health::unknown) {
      seen = now;
    } else if (now >= seen + patience_) {
      return device + " worked before, and has not answered since";
    }
  }
  if (now < *until_) return std::nullopt;
  return "nobody has confirmed it in time";
}

}  // namespace baudgate::reload
