// SPDX-License-Identifier: Apache-2.0
#include "gateway/route_queue.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace baudgate {
namespace {

constexpr std::uint8_t kAllSlaves = 0;

/// MODBUS Application Protocol 1.1b3, 6: the functions that only read, whoever the slave is.
bool IsRead(const RoutedRequest& request) { return request.pdu[0] >= 1 && request.pdu[0] <= 4; }

/// What is not known to read may change the slave.
bool IsWrite(const RoutedRequest& request) { return !IsRead(request); }

bool IsShortWrite(const RoutedRequest& request) {
  switch (request.pdu[0]) {
    case 5:   // one coil
    case 6:   // one register
    case 22:  // bits of one register
      return true;
    case 15:
    case 16:  // function, start, count, byte count, values
      return request.pdu.size() <= 6 + 2 * RouteQueue::kShortWrite;
    default:
      return false;
  }
}

bool SameSlave(const RoutedRequest& a, const RoutedRequest& b) {
  return a.slave == b.slave || a.slave == kAllSlaves || b.slave == kAllSlaves;
}

/// Whether `later` has to wait for `earlier`.
bool Follows(const RoutedRequest& later, const RoutedRequest& earlier) {
  if (!IsWrite(earlier) || !SameSlave(later, earlier)) return false;
  return IsWrite(later) || later.client == earlier.client;
}

}  // namespace

void RouteQueue::Push(RoutedRequest request) {
  if (!turn_.contains(request.client)) turn_[request.client] = ++next_turn_;
  waiting_.push_back(std::move(request));
}

RouteQueue::Batch RouteQueue::TakeUrgent(const MayAsk& may_ask) {
  return TakeBest(may_ask, [this](Place request) { return IsUrgent(request); });
}

RouteQueue::Batch RouteQueue::Take(config::Priority priority, const MayAsk& may_ask) {
  return TakeBest(may_ask, [priority](Place request) { return request->priority == priority; });
}

RouteQueue::Batch RouteQueue::TakeFor(std::uint8_t slave) {
  const auto of_slave = [slave](const RoutedRequest& request) { return request.slave == slave; };
  auto found = std::ranges::find_if(waiting_, [&](const RoutedRequest& request) {
    return of_slave(request) && IsWrite(request);
  });
  if (found == waiting_.end()) found = std::ranges::find_if(waiting_, of_slave);
  return found == waiting_.end() ? Batch() : TakeWithTwins(found);
}

std::vector<RoutedRequest> RouteQueue::TakeReads(std::uint8_t slave, std::size_t keep) {
  return TakeIf([slave, keep](const RoutedRequest& request) mutable {
    if (request.slave != slave || !IsRead(request)) return false;
    if (keep == 0) return true;
    --keep;
    return false;
  });
}

std::vector<RoutedRequest> RouteQueue::TakeExpired(Instant now) {
  return TakeIf([now](const RoutedRequest& request) { return request.deadline <= now; });
}

std::vector<RoutedRequest> RouteQueue::TakeAll() {
  return TakeIf([](const RoutedRequest&) { return true; });
}

std::size_t RouteQueue::Forget(std::uint64_t client) {
  return TakeIf([client](const RoutedRequest& request) { return request.client == client; }).size();
}

bool RouteQueue::HasShortWrite() const { return std::ranges::any_of(waiting_, IsShortWrite); }

std::size_t RouteQueue::Clients(config::Priority priority) const {
  std::vector<std::uint64_t> clients;
  for (const RoutedRequest& request : waiting_) {
    if (request.priority == priority) clients.push_back(request.client);
  }
  std::sort(clients.begin(), clients.end());
  const auto end = std::unique(clients.begin(), clients.end());
  return static_cast<std::size_t>(end - clients.begin());
}

std::vector<std::uint8_t> RouteQueue::Slaves() const {
  std::vector<std::uint8_t> slaves;
  for (const RoutedRequest& request : waiting_) {
    if (std::ranges::find(slaves, request.slave) == slaves.end()) slaves.push_back(request.slave);
  }
  return slaves;
}

std::optional<Instant> RouteQueue::Deadline() const {
  std::optional<Instant> soonest;
  for (const RoutedRequest& request : waiting_) {
    if (!soonest || request.deadline < *soonest) soonest = request.deadline;
  }
  return soonest;
}

bool RouteQueue::MayGo(Place request, const MayAsk& may_ask) {
  if (!may_ask(request->slave)) return false;
  return std::none_of(waiting_.begin(), request,
                      [&](const RoutedRequest& earlier) { return Follows(*request, earlier); });
}

/// A block that was written before a short write to the same slave goes before it.
bool RouteQueue::IsUrgent(Place request) {
  return IsWrite(*request) && std::any_of(request, waiting_.end(), [&](const RoutedRequest& later) {
           return IsShortWrite(later) && SameSlave(later, *request);
         });
}

template <typename Wanted>
RouteQueue::Batch RouteQueue::TakeBest(const MayAsk& may_ask, Wanted wanted) {
  auto best = waiting_.end();
  const auto rank = [this](const RoutedRequest& request) {
    return std::pair(-static_cast<int>(request.priority), turn_.at(request.client));
  };
  for (auto request = waiting_.begin(); request != waiting_.end(); ++request) {
    if (best != waiting_.end() && rank(*request) >= rank(*best)) continue;
    if (wanted(request) && MayGo(request, may_ask)) best = request;
  }
  return best == waiting_.end() ? Batch() : TakeWithTwins(best);
}

RouteQueue::Batch RouteQueue::TakeWithTwins(Place request) {
  Batch batch;
  batch.push_back(Remove(request));
  if (!IsRead(batch[0])) return batch;
  const MayAsk anyone = [](std::uint8_t) { return true; };
  for (auto twin = waiting_.begin(); twin != waiting_.end();) {
    const bool alike = twin->slave == batch[0].slave && twin->pdu == batch[0].pdu;
    const auto next = std::distance(waiting_.begin(), twin);
    if (alike && MayGo(twin, anyone)) {
      batch.push_back(Remove(twin));
      twin = waiting_.begin() + next;
    } else {
      ++twin;
    }
  }
  return batch;
}

RoutedRequest RouteQueue::Remove(Place request) {
  RoutedRequest taken = std::move(*request);
  waiting_.erase(request);
  turn_[taken.client] = ++next_turn_;
  ForgetServed(taken.client);
  return taken;
}

template <typename Wanted>
std::vector<RoutedRequest> RouteQueue::TakeIf(Wanted wanted) {
  std::vector<RoutedRequest> taken;
  std::deque<RoutedRequest> kept;
  for (RoutedRequest& request : waiting_) {
    if (wanted(request)) {
      taken.push_back(std::move(request));
    } else {
      kept.push_back(std::move(request));
    }
  }
  waiting_ = std::move(kept);
  for (const RoutedRequest& request : taken) ForgetServed(request.client);
  return taken;
}

void RouteQueue::ForgetServed(std::uint64_t client) {
  const bool waits = std::ranges::any_of(
      waiting_, [client](const RoutedRequest& request) { return request.client == client; });
  if (!waits) turn_.erase(client);
}

}  // namespace baudgate
