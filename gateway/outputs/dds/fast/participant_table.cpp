// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/fast/participant_table.h"

#include <algorithm>

namespace baudgate::dds {
namespace {

constexpr std::size_t kSources = 64;

/// A bucket of `burst` that refills by one every `interval`: takes one out if there is one.
bool MayTake(Instant full_at, Duration interval, std::size_t burst, Instant now) {
  const Instant after = std::max(full_at, now) + interval;
  return after - now <= interval * static_cast<std::int64_t>(burst);
}

}  // namespace

ParticipantTable::ParticipantTable(const ParticipantLimits& limits) : limits_(limits) {
  participants_.reserve(limits.participants);
  sources_.reserve(kSources);
}

void ParticipantTable::Heard(const GuidPrefix& prefix, Instant now) {
  Participant* const known = Find(prefix);
  // A participant that was silent beyond its lease was dropped by the library as well; it must
  // announce itself again.
  if (known != nullptr && known->Lives(now)) known->heard = now;
}

Refusal ParticipantTable::Announce(const GuidPrefix& prefix, std::uint32_t address, Duration lease,
                                   Instant now) {
  lease = std::min(lease, limits_.longest_lease);
  if (Participant* const known = Find(prefix)) {
    known->heard = now;
    known->lease = lease;
    return Refusal::none;
  }
  ForgetSilent(now);
  if (participants_.size() >= limits_.participants) return Refusal::participants;
  const auto of_address =
      static_cast<std::size_t>(std::ranges::count(participants_, address, &Participant::address));
  if (of_address >= limits_.of_address) return Refusal::address;
  Source& source = SourceOf(address);
  if (!MayTake(source.full_at, limits_.new_interval_of_address, limits_.of_address, now)) {
    return Refusal::address;
  }
  if (!MayTake(full_at_, limits_.new_interval, limits_.participants, now)) {
    return Refusal::participants;
  }
  source.full_at = std::max(source.full_at, now) + limits_.new_interval_of_address;
  full_at_ = std::max(full_at_, now) + limits_.new_interval;
  participants_.push_back(
      {.prefix = prefix, .address = address, .lease = lease, .heard = now, .since = now});
  return Refusal::none;
}

void ParticipantTable::Describe(const GuidPrefix& prefix, UdpAddress at, bool own,
                                bool subscribes) {
  Participant* const known = Find(prefix);
  if (known == nullptr) return;
  known->subscribes = subscribes;
  if (known->own && !own) return;  // it announces itself on several networks
  known->at = at;
  known->own = own;
}

void ParticipantTable::Confirmed(const GuidPrefix& prefix) {
  if (Participant* const known = Find(prefix)) known->confirmed = true;
}

std::vector<UdpAddress> ParticipantTable::Reached(Instant now) const {
  std::vector<UdpAddress> reached;
  for (const Participant& one : participants_) {
    if (one.confirmed && one.own && one.subscribes && one.Lives(now)) reached.push_back(one.at);
  }
  return reached;
}

std::vector<UdpAddress> ParticipantTable::Unanswered(Instant now) const {
  std::vector<UdpAddress> unanswered;
  for (const Participant& one : participants_) {
    const bool long_enough = now - one.since >= kUnanswered && one.Lives(now);
    if (long_enough && one.subscribes && !one.confirmed && one.at.port != 0) {
      unanswered.push_back(one.at);
    }
  }
  return unanswered;
}

void ParticipantTable::Left(const GuidPrefix& prefix) {
  Participant* const known = Find(prefix);
  if (known == nullptr) return;
  *known = participants_.back();
  participants_.pop_back();
}

ParticipantTable::Participant* ParticipantTable::Find(const GuidPrefix& prefix) {
  if (last_found_ < participants_.size() && participants_[last_found_].prefix == prefix) {
    return &participants_[last_found_];
  }
  const auto at = std::ranges::find(participants_, prefix, &Participant::prefix);
  if (at == participants_.end()) return nullptr;
  last_found_ = static_cast<std::size_t>(at - participants_.begin());
  return &*at;
}

void ParticipantTable::ForgetSilent(Instant now) {
  std::erase_if(participants_, [now](const Participant& p) { return !p.Lives(now); });
}

/// When all places are taken, the one that is full soonest is the address that matters least.
ParticipantTable::Source& ParticipantTable::SourceOf(std::uint32_t address) {
  const auto at = std::ranges::find(sources_, address, &Source::address);
  if (at != sources_.end()) return *at;
  if (sources_.size() < kSources) return sources_.emplace_back(Source{address, {}});
  Source& least = *std::ranges::min_element(sources_, {}, &Source::full_at);
  least = {address, {}};
  return least;
}

}  // namespace baudgate::dds
