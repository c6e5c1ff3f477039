// SPDX-License-Identifier: Apache-2.0
#include "gateway/route_queue.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace baudgate {
namespace {

constexpr std::uint8_t kAllSlaves = 0;

bool SameSlave(const RoutedRequest& a, const RoutedRequest& b) {
  return a.slave == b.slave || a.slave == kAllSlaves || b.slave == kAllSlaves;
}

/// Whether `later` has to wait for `earlier`.
bool Follows(const RoutedRequest& later, const RoutedRequest& earlier) {
  if (!IsWrite(earlier) || !SameSlave(later, earlier)) return false;
  return IsWrite(later) || later.client == earlier.client;
}

}  // namespace

bool RouteQueue::IsShortWrite(const RoutedRequest& request) {
  switch (request.pdu[0]) {
    case 5:   // one coil
    case 6:   // one register
    case 22:  // bits of one register
      return true;
    case 15:
    case 16:  // function, start, count, byte count, values
      return request.pdu.size() <= 6 + 2 * kShortWrite;
    default:
      return false;
  }
}

void RouteQueue::Push(RoutedRequest request) {
  if (!turn_.contains(request.client)) turn_[request.client] = ++next_turn_;
  waiting_.push_back(std::move(request));
}

void RouteQueue::Return(Batch batch) {
  for (const RoutedRequest& request : batch) {
    if (!turn_.contains(request.client)) turn_[request.client] = ++next_turn_;
  }
  waiting_.insert(waiting_.begin(), std::make_move_iterator(batch.begin()),
                  std::make_move_iterator(batch.end()));
}

RouteQueue::Batch RouteQueue::TakeUrgent(const MayAsk& may_ask) {
  return TakeBest(may_ask, [this](std::size_t place) { return IsUrgent(place); });
}

RouteQueue::Batch RouteQueue::Take(config::Priority priority, const MayAsk& may_ask) {
  return TakeBest(may_ask, [this, priority](std::size_t place) {
    return waiting_[place].priority == priority;
  });
}

RouteQueue::Batch RouteQueue::TakeFor(std::uint8_t slave) {
  const auto place = NextFor(slave);
  return place ? TakeWithTwins(*place) : Batch();
}

std::vector<RoutedRequest> RouteQueue::TakeReads(std::uint8_t slave, std::size_t keep) {
  return TakeIf([slave, keep](const RoutedRequest& request) mutable {
    if (request.slave != slave || IsWrite(request)) return false;
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

bool RouteQueue::HasAny(const MayAsk& may_ask) const {
  return std::ranges::any_of(waiting_, may_ask);
}

std::optional<std::uint64_t> RouteQueue::FirstWrite(std::uint8_t slave) const {
  for (const RoutedRequest& request : waiting_) {
    const bool to_it = request.slave == slave || request.slave == kAllSlaves;
    if (to_it && IsWrite(request)) return request.sequence;
  }
  return std::nullopt;
}

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

bool RouteQueue::MayGo(std::size_t place) const {
  for (std::size_t earlier = 0; earlier < place; ++earlier) {
    if (Follows(waiting_[place], waiting_[earlier])) return false;
  }
  return true;
}

/// A block that was written before a short write to the same slave goes before it.
bool RouteQueue::IsUrgent(std::size_t place) const {
  if (!IsWrite(waiting_[place])) return false;
  for (std::size_t later = place; later < waiting_.size(); ++later) {
    if (IsShortWrite(waiting_[later]) && SameSlave(waiting_[later], waiting_[place])) return true;
  }
  return false;
}

std::optional<std::size_t> RouteQueue::NextFor(std::uint8_t slave) const {
  std::optional<std::size_t> read;
  for (std::size_t place = 0; place < waiting_.size(); ++place) {
    if (waiting_[place].slave != slave || !MayGo(place)) continue;
    if (IsWrite(waiting_[place])) return place;
    if (!read) read = place;
  }
  return read;
}

template <typename Wanted>
RouteQueue::Batch RouteQueue::TakeBest(const MayAsk& may_ask, Wanted wanted) {
  std::optional<std::size_t> best;
  const auto rank = [this](std::size_t place) {
    const RoutedRequest& request = waiting_[place];
    return std::pair(-static_cast<int>(request.priority), turn_.at(request.client));
  };
  for (std::size_t place = 0; place < waiting_.size(); ++place) {
    if (best && rank(place) >= rank(*best)) continue;
    if (wanted(place) && may_ask(waiting_[place]) && MayGo(place)) best = place;
  }
  return best ? TakeWithTwins(*best) : Batch();
}

RouteQueue::Batch RouteQueue::TakeWithTwins(std::size_t place) {
  Batch batch;
  batch.push_back(Remove(place));
  if (IsWrite(batch[0])) return batch;
  for (std::size_t twin = 0; twin < waiting_.size();) {
    const RoutedRequest& other = waiting_[twin];
    const bool alike = other.slave == batch[0].slave && other.pdu == batch[0].pdu;
    if (alike && MayGo(twin)) {
      batch.push_back(Remove(twin));
    } else {
      ++twin;
    }
  }
  return batch;
}

RoutedRequest RouteQueue::Remove(std::size_t place) {
  RoutedRequest taken = std::move(waiting_[place]);
  waiting_.erase(waiting_.begin() + static_cast<std::ptrdiff_t>(place));
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
