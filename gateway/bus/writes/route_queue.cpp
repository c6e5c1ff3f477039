// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/writes/route_queue.h"

#include <algorithm>
#include <array>
#include <bitset>
#include <iterator>
#include <limits>
#include <tuple>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "gateway/base/time.h"
#include "gateway/bus/devices/roster.h"
#include "protocols/protocol.h"

namespace baudgate::bus {

namespace {

constexpr std::uint8_t kAllSlaves = 0;

using SlaveSet = std::bitset<256>;

bool Meets(const SlaveSet& written, std::uint8_t slave) {
  return slave == kAllSlaves ? written.any() : written[slave] || written[kAllSlaves];
}

/// Collects the writes that were found while the queue is searched from its oldest request. LetPass
/// returns false for a write if an earlier write to its slave waits, and for a read if an earlier
/// write of its own client to its slave waits.
class Earlier {
 public:
  void Add(const RoutedRequest& request) {
    if (!IsWrite(request)) return;
    written_.set(request.slave);
    of_client_[request.client].set(request.slave);
  }
  bool LetPass(const RoutedRequest& request) const {
    if (!Meets(written_, request.slave)) return true;
    if (IsWrite(request)) return false;
    const auto own = of_client_.find(request.client);
    return own == of_client_.end() || !Meets(own->second, request.slave);
  }

 private:
  SlaveSet written_;
  std::unordered_map<std::uint64_t, SlaveSet> of_client_;
};

}  // namespace

bool RouteQueue::IsShortWrite(const RoutedRequest& request) {
  switch (request.pdu[0]) {
    case modbus::kWriteCoil:
    case modbus::kWriteRegister:
    case modbus::kMaskWrite:
      return true;
    case modbus::kWriteCoils:
    case modbus::kWriteRegisters:
      return request.pdu.size() <= modbus::kWriteHeader + 2 * kShortWrite;
    default:
      return false;
  }
}

bool RouteQueue::TakePlace(FairPlaces& places, const RoutedRequest& request) {
  const bool short_write = IsShortWrite(request);
  const std::size_t weight = short_write                                    ? 7
                             : request.priority == config::Priority::high   ? 7
                             : request.priority == config::Priority::normal ? 3
                                                                            : 1;
  return places.Take(request.host, weight, short_write ? kKept : 0);
}

void RouteQueue::AddTurns(const RoutedRequest& request) {
  turn_of_host_.try_emplace(request.host, ++next_turn_);
  turn_of_client_.try_emplace(request.client, next_turn_);
}

void RouteQueue::Push(RoutedRequest request) {
  AddTurns(request);
  waiting_.push_back(std::move(request));
}

void RouteQueue::Return(Batch batch) {
  for (const RoutedRequest& request : batch) AddTurns(request);
  waiting_.insert(waiting_.begin(), std::make_move_iterator(batch.begin()),
                  std::make_move_iterator(batch.end()));
}

bool RouteQueue::HasUrgent(std::uint8_t slave) const {
  const auto next = NextFor(slave);
  return next && IsWrite(waiting_[*next]) &&
         std::ranges::any_of(waiting_, [slave](const RoutedRequest& request) {
           return request.slave == slave && IsShortWrite(request);
         });
}

RouteQueue::Batch RouteQueue::TakeUrgent(const MayAsk& may_ask) {
  std::array<std::size_t, 256> ends{};  // for each slave: position after its last short write
  std::size_t end = 0;                  // position after the last short write to any slave
  for (std::size_t place = 0; place < waiting_.size(); ++place) {
    if (IsShortWrite(waiting_[place])) end = ends[waiting_[place].slave] = place + 1;
  }
  if (end == 0) return {};
  return TakeBest(may_ask, [&](std::size_t place) {
    const RoutedRequest& request = waiting_[place];
    const bool to_all = request.slave == kAllSlaves;
    return IsWrite(request) &&
           place < (to_all ? end : std::max(ends[request.slave], ends[kAllSlaves]));
  });
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
  const auto is_read = [slave](const RoutedRequest& request) {
    return request.slave == slave && !IsWrite(request);
  };
  const auto reads = static_cast<std::size_t>(std::ranges::count_if(waiting_, is_read));
  if (reads <= keep) return {};
  return TakeIf([&is_read, keep](const RoutedRequest& request) mutable {
    if (!is_read(request)) return false;
    if (keep == 0) return true;
    --keep;
    return false;
  });
}

std::vector<RoutedRequest> RouteQueue::TakeOf(std::uint8_t slave) {
  return TakeIf([slave](const RoutedRequest& request) { return request.slave == slave; });
}

std::vector<RoutedRequest> RouteQueue::TakeExpired(Instant now) {
  const auto deadline = Deadline();
  if (!deadline || *deadline > now) return {};
  return TakeIf([now](const RoutedRequest& request) { return request.deadline <= now; });
}

std::vector<RoutedRequest> RouteQueue::TakeAll() {
  return TakeIf([](const RoutedRequest&) { return true; });
}

void RouteQueue::Abandon(std::uint64_t client) {
  const auto gone =
      TakeIf([client](const RoutedRequest& request) { return request.client == client; });
  for (const RoutedRequest& request : gone) request.done(Abandoned(request.tries > 0));
}

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
  SlaveSet seen;
  std::vector<std::uint8_t> slaves;
  for (const RoutedRequest& request : waiting_) {
    if (!seen[request.slave]) slaves.push_back(request.slave);
    seen.set(request.slave);
  }
  return slaves;
}

std::optional<Instant> RouteQueue::Deadline() const {
  std::optional<Instant> soonest;
  for (const RoutedRequest& request : waiting_) {
    soonest = Soonest({soonest, request.deadline});
  }
  return soonest;
}

std::optional<std::size_t> RouteQueue::NextFor(std::uint8_t slave) const {
  std::optional<std::size_t> read;
  Earlier earlier;
  for (std::size_t place = 0; place < waiting_.size(); ++place) {
    const RoutedRequest& request = waiting_[place];
    const bool for_it = request.slave == slave;
    if (for_it && earlier.LetPass(request)) {
      if (IsWrite(request)) return place;
      if (!read) read = place;
    }
    if (for_it || request.slave == kAllSlaves || slave == kAllSlaves) earlier.Add(request);
  }
  return read;
}

template <typename Wanted>
RouteQueue::Batch RouteQueue::TakeBest(const MayAsk& may_ask, Wanted wanted) {
  using Rank = std::tuple<int, std::uint64_t, std::uint64_t>;
  std::optional<std::pair<Rank, std::size_t>> best;
  Earlier earlier;
  for (std::size_t place = 0; place < waiting_.size(); ++place) {
    const RoutedRequest& request = waiting_[place];
    const Rank rank(-static_cast<int>(request.priority), turn_of_host_.at(request.host),
                    turn_of_client_.at(request.client));
    const bool better = !best || rank < best->first;
    if (better && wanted(place) && may_ask(request) && earlier.LetPass(request)) {
      best.emplace(rank, place);
    }
    earlier.Add(request);
  }
  return best ? TakeWithTwins(best->second) : Batch();
}

RouteQueue::Batch RouteQueue::TakeWithTwins(std::size_t place) {
  Batch batch;
  batch.push_back(std::move(waiting_[place]));
  waiting_.erase(waiting_.begin() + static_cast<std::ptrdiff_t>(place));
  const auto alike = [slave = batch[0].slave, pdu = batch[0].pdu](const RoutedRequest& other) {
    return other.slave == slave && other.pdu == pdu;
  };
  if (!IsWrite(batch[0]) && std::ranges::any_of(waiting_, alike)) {
    Earlier earlier;
    std::vector<RoutedRequest> twins = TakeIf([&](const RoutedRequest& other) {
      earlier.Add(other);  // Add ignores reads, so a twin does not block itself
      return alike(other) && earlier.LetPass(other);
    });
    batch.insert(batch.end(), std::make_move_iterator(twins.begin()),
                 std::make_move_iterator(twins.end()));
  }
  for (const RoutedRequest& taken : batch) {
    turn_of_host_[taken.host] = turn_of_client_[taken.client] = ++next_turn_;
  }
  ForgetServed(batch);
  return batch;
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
  ForgetServed(taken);
  return taken;
}

void RouteQueue::ForgetServed(const std::vector<RoutedRequest>& taken) {
  const auto forget = [&](TurnBy& turns, std::uint64_t RoutedRequest::*who) {
    std::unordered_set<std::uint64_t> served;
    for (const RoutedRequest& request : taken) served.insert(request.*who);
    for (auto waits = waiting_.begin(); waits != waiting_.end() && !served.empty(); ++waits) {
      served.erase((*waits).*who);
    }
    for (const std::uint64_t one : served) turns.erase(one);
  };
  forget(turn_of_host_, &RoutedRequest::host);
  forget(turn_of_client_, &RoutedRequest::client);
}

namespace {

/// Client number of requests that the gateway itself repeats for an offline slave.
constexpr std::uint64_t kNobody = std::numeric_limits<std::uint64_t>::max();

}  // namespace

std::optional<Instant> RoutedSide::ClientsGone() const {
  return answered_at_ ? std::optional(*answered_at_ + kClientsReturn) : std::nullopt;
}

std::vector<RoutedRequest> RoutedSide::TakeHopeless(const Member& slave, std::size_t keep,
                                                    const protocols::PduCarrier& carrier,
                                                    Instant now) {
  std::vector<RoutedRequest> reads = queue_.TakeReads(slave.slave, keep);
  for (const RoutedRequest& read : reads) {
    if (carrier.is_common(read.pdu)) refused_[slave.slave] = {read.pdu, now};
  }
  return reads;
}

bool RoutedSide::MayRepeatRead(const Member& slave, bool behind, Instant now) const {
  const auto refused = refused_.find(slave.slave);
  if (refused == refused_.end()) return false;
  return now - refused->second.at < (behind ? kStillWanted : kClientsReturn);
}

RouteQueue::Batch RoutedSide::RepeatRead(const Member& slave) const {
  RoutedRequest read;
  read.client = kNobody;
  read.slave = slave.slave;
  read.pdu = refused_.at(slave.slave).pdu;
  read.deadline = Instant::max();
  read.done = [](const RoutedReply&) {};
  RouteQueue::Batch batch;
  batch.push_back(std::move(read));
  return batch;
}

}  // namespace baudgate::bus
