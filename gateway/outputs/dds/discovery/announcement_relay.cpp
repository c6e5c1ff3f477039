// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/discovery/announcement_relay.h"

#include <algorithm>
#include <utility>

#include "gateway/outputs/dds/refusal.h"

namespace baudgate::dds {
namespace {

// A datagram may be lost, so the first ones are passed on all.
constexpr int kFirstRounds = 3;
constexpr std::size_t kMostAddresses = 1024;

}  // namespace

AnnouncementRelay::AnnouncementRelay(const RelayLimits& limits)
    : limits_(limits), sent_{limits.to_all.burst, {}} {
  known_.reserve(limits.participants);
}

Relayed AnnouncementRelay::On(View datagram, UdpAddress sender, Instant now) {
  introductions_.clear();
  if (datagram.size() > limits_.datagram) return {{}, "an announcement that is too long"};
  auto announcement = ReadAnnouncement(datagram, sender);
  if (!announcement) return {{}, announcement.error()};
  // Anybody can say so for another: the end of the lease will tell.
  if (announcement->leaves) return {};
  ForgetSilent(now);
  Known* one = Find(announcement->participant);
  if (one == nullptr) {
    if (std::string refused = Admit(std::move(*announcement), sender, now); !refused.empty()) {
      return {{}, std::move(refused)};
    }
    one = &known_.back();
    IntroduceOthersTo(*one, now);
  } else {
    // A machine with two networks announces itself from both: the first one stays.
    if (one->announcement.at.address != sender.address) return {};
    one->heard = now;
    if (!std::ranges::equal(one->announcement.said(), announcement->said())) one->rounds = 0;
    one->announcement = std::move(*announcement);
  }
  if (IsDue(*one, now) && one->purse.Take(limits_.rounds_of_participant, now)) {
    IntroduceToOthers(*one, now);
  }
  return {introductions_, {}};
}

void AnnouncementRelay::ForgetSilent(Instant now) {
  std::erase_if(known_, [&](const Known& one) {
    return now - one.heard > std::min(one.announcement.lease, limits_.longest_lease);
  });
}

AnnouncementRelay::Known* AnnouncementRelay::Find(const GuidPrefix& participant) {
  const auto at = std::ranges::find(known_, participant,
                                    [](const Known& one) { return one.announcement.participant; });
  return at == known_.end() ? nullptr : &*at;
}

std::string AnnouncementRelay::Admit(Announcement announcement, UdpAddress sender, Instant now) {
  if (known_.size() >= limits_.participants) return std::string(Words(Refusal::participants));
  const auto of_address = std::ranges::count(
      known_, sender.address, [](const Known& one) { return one.announcement.at.address; });
  if (static_cast<std::size_t>(of_address) >= limits_.of_address ||
      !AddressOf(sender.address, now).newcomers.Take(limits_.new_of_address, now)) {
    return std::string(Words(Refusal::address));
  }
  known_.push_back(
      {std::move(announcement), now, 0, {}, Purse{limits_.rounds_of_participant.burst, now}});
  return {};
}

bool AnnouncementRelay::IsDue(const Known& one, Instant now) const {
  const Duration repeat =
      std::max(limits_.repeat, limits_.repeat_each * static_cast<std::int64_t>(known_.size()));
  return one.rounds < kFirstRounds || now - one.last_round >= repeat;
}

void AnnouncementRelay::IntroduceOthersTo(const Known& newcomer, Instant now) {
  for (const Known& other : known_) Introduce(other, newcomer, now);
}

void AnnouncementRelay::IntroduceToOthers(Known& one, Instant now) {
  one.rounds = std::min(one.rounds + 1, kFirstRounds);
  one.last_round = now;
  for (const Known& other : known_) Introduce(one, other, now);
}

/// What does not fit into the rates is not sent: the next round comes.
void AnnouncementRelay::Introduce(const Known& whom, const Known& to, Instant now) {
  if (&whom == &to || whom.announcement.domain != to.announcement.domain) return;
  const Role role = whom.announcement.role;
  if (role != Role::any && role == to.announcement.role) return;
  const UdpAddress& at = to.announcement.at;
  if (!AddressOf(at.address, now).sent.Take(limits_.to_address, now)) return;
  if (!sent_.Take(limits_.to_all, now)) return;
  introductions_.push_back({at, whom.announcement.datagram});
}

/// When all places are taken, the one that was used longest ago makes room.
AnnouncementRelay::Address& AnnouncementRelay::AddressOf(std::uint32_t address, Instant now) {
  auto at = std::ranges::find(addresses_, address, &Address::address);
  if (at == addresses_.end()) {
    if (addresses_.size() < kMostAddresses) {
      at = addresses_.insert(addresses_.end(), Address{});
    } else {
      at = std::ranges::min_element(addresses_, {}, &Address::used);
    }
    *at = {address, {limits_.new_of_address.burst, now}, {limits_.to_address.burst, now}, now};
  }
  at->used = now;
  return *at;
}

bool AnnouncementRelay::Purse::Take(const RelayRate& rate, Instant now) {
  // Whole datagrams only: what a moment is short of the next one counts for it later.
  const Duration each = Duration(1s) / rate.each_second;
  const std::int64_t earned = std::clamp<std::int64_t>((now - filled) / each, 0, rate.burst);
  if (earned > 0) {
    left = std::min(rate.burst, left + earned);
    filled = earned == rate.burst ? now : filled + earned * each;
  }
  if (left == 0) return false;
  --left;
  return true;
}

}  // namespace baudgate::dds
