// SPDX-License-Identifier: Apache-2.0
#include "gateway/diagnosis/observer.h"

#include <memory>
#include <utility>

#include "gateway/diagnosis/damage/examine.h"

namespace baudgate {

Observer::Observer(const Roster& roster) : examiner_(roster) {
  if (Device* const speaker = roster.Speaker()) overheard_.emplace(*speaker, roster);
}

void Observer::OnRequest(const Member& member, const Request& request, Instant now) {
  examiner_.Begin(member, request, member.times, now);
}

std::vector<EarlierFinding> Observer::TakeChanged() {
  std::vector<EarlierFinding> changed;
  if (auto more = examiner_.More()) changed.push_back({examiner_.member(), std::move(*more)});
  while (auto earlier = examiner_.TakeEarlier()) changed.push_back(std::move(*earlier));
  return changed;
}

std::optional<Finding> Observer::OnUnaskedBytes(View bytes, Instant now) {
  return overheard_ ? overheard_->Hear(bytes, now) : std::nullopt;
}

bool Observer::IsNegotiation(View bytes) const { return IsTelnet(bytes); }

Finding Observer::OnUnaskedDamage() { return overheard_->OnDamaged(); }

void Observer::OnUnaskedRead() { overheard_->OnRead(); }

std::unique_ptr<LineObserver> Observe(const Roster& roster) {
  return std::make_unique<Observer>(roster);
}

}  // namespace baudgate
