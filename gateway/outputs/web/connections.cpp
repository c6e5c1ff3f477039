// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/web/connections.h"

#include <algorithm>

#include "gateway/outputs/web/front_door.h"

namespace baudgate::web {

Limits Limits::Of(std::size_t descriptors) {
  constexpr std::size_t kFew = 4;
  Limits limits;
  limits.at_all = std::clamp(descriptors, kFew, limits.at_all);
  limits.connections = std::min(limits.connections, limits.at_all * 4 / 5);
  limits.of_address = std::min(limits.of_address, limits.connections);
  return limits;
}

std::optional<Connections::Id> Connections::Open(Id id, const std::string& peer, Instant now) {
  std::optional<Id> ends;
  if (all_.size() >= limits_.at_all) {
    Instant oldest = Instant::max();
    for (const auto& [other, connection] : all_) {
      if (connection.busy() || connection.since >= oldest) continue;
      oldest = connection.since;
      ends = other;
    }
  }
  all_[id] = {peer, now};
  return ends;
}

bool Connections::Begin(Id id, Instant now) {
  const auto found = all_.find(id);
  if (found == all_.end()) return false;
  const std::string& peer = found->second.peer;
  std::size_t busy = 0;
  std::size_t of_address = 0;
  for (const auto& [other, connection] : all_) {
    if (!connection.busy()) continue;
    ++busy;
    if (connection.peer == peer) ++of_address;
  }
  const bool fits =
      busy < limits_.connections && (IsLoopbackPeer(peer) || of_address < limits_.of_address);
  found->second.state = Connection::State::answered;  // refused or not: it sends something
  found->second.since = now;
  return fits;
}

void Connections::Stream(Id id) {
  const auto found = all_.find(id);
  if (found != all_.end()) found->second.state = Connection::State::streams;
}

void Connections::End(Id id, Instant now) {
  const auto found = all_.find(id);
  if (found == all_.end()) return;
  found->second.state = Connection::State::waits;
  found->second.since = now;
}

std::vector<Connections::Id> Connections::Overdue(Instant now) const {
  std::vector<Id> overdue;
  for (const auto& [id, connection] : all_) {
    if (connection.state == Connection::State::streams) continue;
    const Duration most = connection.busy() ? limits_.answer : limits_.request;
    if (now - connection.since >= most) overdue.push_back(id);
  }
  return overdue;
}

}  // namespace baudgate::web
