// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/fast/endpoint_table.h"

#include <algorithm>

namespace baudgate::dds {
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

}  // namespace baudgate::dds
