// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/service/pending_requests.h"

#include <algorithm>

#include "gateway/base/deadline.h"

namespace baudgate::modbus {

std::optional<PendingRequest> PendingRequests::Take(std::uint64_t number) {
  const auto found = std::ranges::find(requests_, number, &PendingRequest::number);
  if (found == requests_.end()) return std::nullopt;
  PendingRequest request = std::move(*found);
  requests_.erase(found);
  return request;
}

void PendingRequests::AbandonAll() {
  for (PendingRequest& request : requests_) request.abandoned = true;
}

std::optional<Instant> PendingRequests::Deadline() const {
  std::optional<Instant> next;
  for (const PendingRequest& request : requests_) next = Soonest({next, request.Limit()});
  return next;
}

std::vector<std::uint64_t> PendingRequests::Overdue(Instant now) const {
  std::vector<std::uint64_t> overdue;
  for (const PendingRequest& request : requests_) {
    if (now >= request.Limit()) overdue.push_back(request.number);
  }
  return overdue;
}

}  // namespace baudgate::modbus
