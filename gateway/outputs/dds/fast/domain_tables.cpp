// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/fast/domain_tables.h"

#include <algorithm>

namespace baudgate::dds {
namespace {

constexpr std::size_t kSources = 64;

/// True if a token bucket is not empty. It holds `burst` tokens and gains one every `interval`;
/// `full_at` is the time when it is full. The caller takes a token by adding `interval` to
/// `full_at`.
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
  // If the participant's lease has ended, its entry is not renewed: the library has dropped the
  // participant, which must announce itself again.
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
  // A server's announcement does not replace the participant's own.
  if (known->own && !own) return;
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

ParticipantTable::Source& ParticipantTable::SourceOf(std::uint32_t address) {
  const auto at = std::ranges::find(sources_, address, &Source::address);
  if (at != sources_.end()) return *at;
  if (sources_.size() < kSources) return sources_.emplace_back(Source{address, {}});
  Source& least = *std::ranges::min_element(sources_, {}, &Source::full_at);
  least = {address, {}};
  return least;
}

namespace {

std::uint32_t EntityOf(const Guid& guid) { return *ByteReader(guid).U32Be(12); }

}  // namespace

bool EndpointTable::Announce(const Guid& endpoint, ParticipantTable& participants, Instant now) {
  const GuidPrefix prefix = PrefixOf(endpoint);
  if (!participants.Has(prefix)) return true;
  Owner* owner = Find(prefix);
  if (owner == nullptr) {
    std::erase_if(owners_, [&](const Owner& one) { return !participants.Has(one.prefix); });
    owner = &owners_.emplace_back(Owner{.prefix = prefix, .entities = {}});
  }
  const std::uint32_t entity = EntityOf(endpoint);
  if (std::ranges::find(owner->entities, entity) != owner->entities.end()) return true;
  if (owner->entities.size() >= limits_.of_participant || size() >= limits_.all) return false;
  const Instant full_at = std::max(owner->full_at, now) + limits_.new_interval;
  const auto burst = static_cast<std::int64_t>(limits_.of_participant);
  if (full_at - now > limits_.new_interval * burst) return false;
  owner->full_at = full_at;
  owner->entities.push_back(entity);
  return true;
}

void EndpointTable::Left(const Guid& endpoint) {
  Owner* const owner = Find(PrefixOf(endpoint));
  if (owner != nullptr) std::erase(owner->entities, EntityOf(endpoint));
}

void EndpointTable::ParticipantLeft(const GuidPrefix& prefix) {
  std::erase_if(owners_, [&](const Owner& owner) { return owner.prefix == prefix; });
}

std::size_t EndpointTable::size() const {
  std::size_t all = 0;
  for (const Owner& owner : owners_) all += owner.entities.size();
  return all;
}

EndpointTable::Owner* EndpointTable::Find(const GuidPrefix& prefix) {
  const auto at = std::ranges::find(owners_, prefix, &Owner::prefix);
  return at == owners_.end() ? nullptr : &*at;
}

namespace {

// The table consists of 512 sets of four writers. A new writer replaces the writer of its set that
// was silent longest.
constexpr std::size_t kSets = 512;
constexpr std::size_t kWays = 4;

std::size_t SetOf(const Guid& guid) {
  std::uint32_t hash = 2166136261;
  for (const std::uint8_t byte : guid) hash = (hash ^ byte) * 16777619;
  return (hash ^ (hash >> 16)) % kSets;
}

/// True if the entity is built in, e.g. a discovery writer: its kind, the last byte, is 0xC0 or
/// more (RTPS 2.3, 9.3.1.2).
bool IsBuiltIn(const Guid& guid) { return (guid.back() & 0xC0) == 0xC0; }

}  // namespace

SequenceWindow::SequenceWindow(const WindowLimits& limits)
    : limits_(limits), writers_(kSets * kWays), purse_(limits.burst) {}

bool SequenceWindow::Advance(const Guid& guid, std::int64_t to, std::int64_t skipped, Instant now) {
  Writer& writer = Find(guid);
  const bool is_new = writer.guid != guid;
  const std::int64_t told = is_new ? 0 : writer.told;
  if (is_new && !IsBuiltIn(guid)) {
    if (to > limits_.first_of_samples) return false;
  } else if (!Pay(std::max({to - told, skipped, std::int64_t{0}}), now)) {
    return false;
  }
  writer = {guid, std::max(told, to), now};
  return true;
}

/// Returns the writer's entry; if there is none, the entry of the same set that was used longest
/// ago, which the writer may replace.
SequenceWindow::Writer& SequenceWindow::Find(const Guid& guid) {
  const auto set = writers_.begin() + static_cast<std::ptrdiff_t>(SetOf(guid) * kWays);
  const auto end = set + static_cast<std::ptrdiff_t>(kWays);
  const auto at = std::find_if(set, end, [&](const Writer& writer) { return writer.guid == guid; });
  if (at != end) return *at;
  return *std::min_element(set, end,
                           [](const Writer& a, const Writer& b) { return a.heard < b.heard; });
}

bool SequenceWindow::Pay(std::int64_t steps, Instant now) {
  if (steps == 0) return true;
  const auto passed = std::clamp<std::int64_t>((now - filled_) / 1ms, 0, 1'000'000);
  if (passed > 0) {
    purse_ = std::min(limits_.burst, purse_ + passed * limits_.each_second / 1000);
    filled_ = now;
  }
  if (steps > purse_) return false;
  purse_ -= steps;
  return true;
}

}  // namespace baudgate::dds
