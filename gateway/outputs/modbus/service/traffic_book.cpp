// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/service/traffic_book.h"

#include <algorithm>

namespace baudgate::modbus {

ModbusCounters LiveCounters::Snapshot() const {
  const auto read = [](const std::atomic<std::uint64_t>& counter) {
    return counter.load(std::memory_order_relaxed);
  };
  ModbusCounters copy;
  copy.clients = read(clients);
  copy.accepted = read(accepted);
  copy.refused = read(refused);
  copy.malformed = read(malformed);
  copy.idle = read(idle);
  copy.stalled = read(stalled);
  copy.accept_errors = read(accept_errors);
  copy.requests = read(requests);
  copy.exceptions = read(exceptions);
  return copy;
}

namespace {

void Count(RouteCounters& counters, RouteOutcome end, const bus::RoutedReply& reply) {
  switch (end) {
    case RouteOutcome::ok:
      ++counters.ok;
      break;
    case RouteOutcome::refused:
      ++counters.refused;
      break;
    case RouteOutcome::denied:
      ++counters.denied;
      break;
    case RouteOutcome::no_reply:
      ++counters.no_reply;
      break;
    case RouteOutcome::expired:
      ++counters.expired;
      break;
    case RouteOutcome::busy:
      ++counters.busy;
      break;
    case RouteOutcome::abandoned:
      ++counters.dropped;
      break;
    case RouteOutcome::broadcast:
      ++counters.broadcasts;
      break;
  }
  counters.longest_wait = std::max(counters.longest_wait, reply.waited);
  if (end != RouteOutcome::ok && end != RouteOutcome::refused) return;
  counters.total_wait += reply.waited;
  if (reply.shared) ++counters.shared;
}

ClientStatus StatusOf(const ClientRecord& record, const Now& now) {
  constexpr auto kRelaxed = std::memory_order_relaxed;
  ClientStatus status;
  status.id = record.id;
  status.peer = record.peer;
  status.listener = record.listener;
  status.priority = record.priority;
  status.since = record.since;
  const Instant last = record.last_request.load(kRelaxed);
  if (last != Instant::min()) status.last_request = now.wall - (now.instant - last);
  status.requests = record.requests.load(kRelaxed);
  status.exceptions = record.exceptions.load(kRelaxed);
  status.bytes_in = record.bytes_in.load(kRelaxed);
  status.bytes_out = record.bytes_out.load(kRelaxed);
  status.outstanding = record.outstanding.load(kRelaxed);
  return status;
}

}  // namespace

TrafficBook::TrafficBook() {
  broadcasts_.units = "0";
  broadcasts_.target = "all lines";
}

void TrafficBook::Show(const RouteList& routes) {
  const MutexLock lock(mutex_);
  for (std::size_t number = routes_.size(); number < routes.size(); ++number) {
    RouteStatus& status = routes_.emplace_back();
    status.units = routes.at(number).Units();
    status.target = routes.at(number).Target();
  }
  shown_.assign(routes.numbers().begin(), routes.numbers().end());
}

RouteStatus& TrafficBook::At(std::size_t route) {
  return route == kBroadcasts ? broadcasts_ : routes_[route];
}

std::shared_ptr<ClientRecord> TrafficBook::Enter(const std::string& peer,
                                                 const config::Listener& listener,
                                                 config::Priority priority, WallTime since) {
  auto record = std::make_shared<ClientRecord>();
  record->peer = peer;
  record->listener = listener.Address();
  record->priority = priority;
  record->since = since;
  const MutexLock lock(mutex_);
  auto& functions = functions_[record->listener];
  if (!functions) functions = std::make_shared<FunctionCounters>();
  record->functions = functions;
  record->id = next_client_++;
  clients_.emplace(record->id, record);
  return record;
}

void TrafficBook::Leave(const ClientRecord& client) {
  const MutexLock lock(mutex_);
  clients_.erase(client.id);
}

void TrafficBook::Asked(std::size_t route, std::uint8_t unit) {
  const MutexLock lock(mutex_);
  RouteStatus& status = At(route);
  ++status.requests;
  ++status.by_unit[unit].requests;
}

void TrafficBook::Ended(std::size_t route, std::uint8_t unit, RouteOutcome end,
                        const bus::RoutedReply& reply, WallTime at) {
  const MutexLock lock(mutex_);
  RouteStatus& status = At(route);
  Count(status, end, reply);
  Count(status.by_unit[unit], end, reply);
  const bool trouble =
      end == RouteOutcome::no_reply || end == RouteOutcome::expired || end == RouteOutcome::busy;
  if (!trouble) return;
  status.last_trouble = reply.reason;
  status.last_trouble_at = at;
}

void TrafficBook::CameLate(std::size_t route) {
  const MutexLock lock(mutex_);
  ++routes_[route].late;
}

std::size_t TrafficBook::AddMaster(const config::Listener& listener, WallTime since) {
  const MutexLock lock(mutex_);
  MasterStatus& master = masters_[next_master_];
  master.port = listener.path;
  master.expected = listener.framing;
  master.text = "not opened yet";
  master.since = since;
  return next_master_++;
}

void TrafficBook::RemoveMaster(std::size_t master) {
  const MutexLock lock(mutex_);
  masters_.erase(master);
}

void TrafficBook::ShowClosed(std::vector<ClosedListener> closed) {
  const MutexLock lock(mutex_);
  closed_ = std::move(closed);
}

void TrafficBook::ShowPort(std::size_t index, bool is_open, const std::string& text, WallTime at) {
  const MutexLock lock(mutex_);
  MasterStatus& master = masters_[index];
  if (master.is_open != is_open) master.since = at;
  master.is_open = is_open;
  master.text = text;
}

void TrafficBook::Heard(std::size_t master, WallTime at) {
  const MutexLock lock(mutex_);
  ++masters_[master].frames;
  masters_[master].last_frame = at;
  masters_[master].other.reset();
}

void TrafficBook::HeardDamage(std::size_t master) {
  const MutexLock lock(mutex_);
  ++masters_[master].damaged;
}

bool TrafficBook::HeardOther(std::size_t master, Framing heard) {
  const MutexLock lock(mutex_);
  return std::exchange(masters_[master].other, heard) != heard;
}

void TrafficBook::HeardOther(const std::string& listener, const std::string& peer, Framing heard,
                             Framing expected, WallTime at) {
  const MutexLock lock(mutex_);
  OtherSpeaker& other = others_[listener];
  other = {listener, peer, heard, expected, other.times + 1, at};
}

void TrafficBook::HeardEcho(std::size_t master) {
  const MutexLock lock(mutex_);
  ++masters_[master].echoes;
}

TrafficStatus TrafficBook::Status(const Now& now) const {
  TrafficStatus status;
  const MutexLock lock(mutex_);
  for (const auto& [id, record] : clients_) status.clients.push_back(StatusOf(*record, now));
  for (const auto& [number, master] : masters_) status.masters.push_back(master);
  status.closed = closed_;
  for (const auto& [listener, other] : others_) status.others.push_back(other);
  for (const auto& [listener, counters] : functions_) {
    counters->AppendTo(listener, status.functions);
  }
  for (const std::size_t number : shown_) status.routes.push_back(routes_[number]);
  if (broadcasts_.requests > 0) status.routes.push_back(broadcasts_);
  return status;
}

}  // namespace baudgate::modbus
