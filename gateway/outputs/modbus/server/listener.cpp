// Listens, accepts, refuses and sweeps.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/server/listener.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "gateway/base/log.h"
#include "gateway/outputs/modbus/server/admission.h"
#include "gateway/outputs/modbus/server/client_log.h"

namespace baudgate::modbus {
namespace {

using asio::ip::tcp;

/// Without file descriptors or memory, accepting at once again would only spin.
constexpr Duration kAcceptPause = 100ms;
/// How often half frames of clients are looked after that speak as on a serial line.
constexpr Duration kSerialSweep = 50ms;

std::string NameOf(const tcp::endpoint& peer) {
  const std::string host = peer.address().to_string();
  return (peer.address().is_v6() ? "[" + host + "]" : host) + ":" + std::to_string(peer.port());
}

PeerAddress AddressOf(const asio::ip::address& address) {
  if (address.is_v6()) return address.to_v6().to_bytes();
  return asio::ip::make_address_v6(asio::ip::v4_mapped, address.to_v4()).to_bytes();
}

Duration SweepPeriodOf(const config::Listener& listener, const ModbusLimits& limits) {
  const Duration shortest = std::min({listener.idle_timeout, limits.write_deadline, limits.stall});
  const Duration period = std::clamp<Duration>(shortest / 4, 10ms, 250ms);
  return listener.speaks_serial() ? std::min(period, kSerialSweep) : period;
}

}  // namespace

Listener::Listener(asio::io_context& io, config::Listener listener, ServerShared& shared)
    : acceptor_(io),
      clients_(std::make_shared<ClientPoll>(io)),
      retry_(io),
      sweep_(io),
      listener_(std::move(listener)),
      shared_(shared),
      sweep_period_(SweepPeriodOf(listener_, shared.limits())) {}

Status Listener::Open(PassedSockets* passed) {
  asio::error_code failed;
  tcp::resolver resolver(acceptor_.get_executor());
  const auto found =
      resolver.resolve(listener_.host, std::to_string(listener_.port),
                       tcp::resolver::passive | tcp::resolver::numeric_service, failed);
  if (failed || found.empty()) {
    return Error{"unknown address; check modbus.listen"};
  }
  const tcp::endpoint endpoint = found.begin()->endpoint();
  const auto descriptor = passed == nullptr ? std::nullopt : passed->Take(endpoint);
  if (descriptor) {
    acceptor_.assign(endpoint.protocol(), *descriptor, failed);
    if (failed) return Error{failed.message()};
    log::Info("modbus: {}: the socket is one that systemd has passed", listener_.Place());
  } else if (Status bound = Listen(acceptor_, endpoint, "modbus.listen"); !bound) {
    return bound;
  }
  port_ = acceptor_.local_endpoint(failed).port();
  return clients_->Open();
}

void Listener::Start() {
  clients_->Start();
  Accept();
  Sweep(ReadClocks());
}

std::string Listener::Summary() const {
  return std::string(Title(listener_.framing)) + (listener_.speaks_serial() ? " over TCP" : "") +
         " on " + listener_.host + ":" + std::to_string(port_);
}

void Listener::Renew(const config::Listener& listener) {
  CloseClients();
  listener_ = listener;
  sweep_period_ = SweepPeriodOf(listener_, shared_.limits());
  Sweep(ReadClocks());
}

void Listener::Stop() {
  stopped_ = true;
  asio::error_code ignored;
  acceptor_.close(ignored);
  retry_.cancel();
  sweep_.cancel();
  CloseClients();
  clients_->Close();
}

void Listener::CloseClients() {
  const auto sessions = std::exchange(sessions_, {});
  for (const auto& [key, session] : sessions) session->Close();
}

void Listener::Accept() {
  acceptor_.async_accept(
      [self = shared_from_this()](const asio::error_code& failed, tcp::socket socket) {
        if (self->stopped_) return;
        if (failed && failed != asio::error::connection_aborted) return self->AcceptLater(failed);
        if (!failed) self->Welcome(std::move(socket));
        self->Accept();
      });
}

void Listener::AcceptLater(const asio::error_code& why) {
  LiveCounters::Add(shared_.counters().accept_errors);
  log::Warn("modbus: no client can be accepted at {}: {}", listener_.Place(), why.message());
  retry_.expires_after(kAcceptPause);
  retry_.async_wait([self = shared_from_this()](const asio::error_code&) {
    if (!self->stopped_) self->Accept();
  });
}

void Listener::Welcome(tcp::socket socket) {
  asio::error_code gone;
  const tcp::endpoint peer = socket.remote_endpoint(gone);
  if (gone) return;
  const std::string name = NameOf(peer);
  const PeerAddress address = AddressOf(peer.address());
  if (!Allows(listener_.allow, address)) {
    return Refuse(name, "its address is not in the allow list");
  }
  if (sessions_.size() >= MostClients()) {
    return Refuse(name, shared_.limits().client_share < 1
                            ? "there is no file descriptor for another client"
                            : "max_clients are connected already");
  }
  asio::error_code failed;
  socket.set_option(tcp::no_delay(true), failed);
  socket.set_option(asio::socket_base::keep_alive(true), failed);
  socket.non_blocking(true, failed);
  if (failed) return;
  const int owned = socket.release(failed);
  if (failed) return;
  LiveCounters& counters = shared_.counters();
  LiveCounters::Add(counters.accepted);
  counters.clients.fetch_add(1, std::memory_order_relaxed);
  auto session =
      std::make_shared<ClientSession>(owned, *clients_, listener_, shared_, name,
                                      PriorityOf(listener_, address), ReadClocks(), *this);
  sessions_.emplace(session.get(), session);
  session->Start();
}

std::size_t Listener::MostClients() const {
  const double most = listener_.max_clients * shared_.limits().client_share;
  return std::max<std::size_t>(static_cast<std::size_t>(most), 1);
}

void Listener::Refuse(std::string_view peer, std::string_view why) {
  LiveCounters::Add(shared_.counters().refused);
  WarnOfClient(peer, "refused", why);
}

void Listener::OnClosed(ClientSession& session) {
  shared_.counters().clients.fetch_sub(1, std::memory_order_relaxed);
  sessions_.erase(&session);
}

void Listener::SweepAt(Instant at) {
  if (at >= next_sweep_) return;
  next_sweep_ = at;
  sweep_.expires_at(at);
  sweep_.async_wait([self = shared_from_this()](const asio::error_code& failed) {
    if (!failed && !self->stopped_) self->Sweep(ReadClocks());
  });
}

void Listener::Sweep(const Now& now) {
  std::vector<std::shared_ptr<ClientSession>> sessions;
  sessions.reserve(sessions_.size());
  for (const auto& [key, session] : sessions_) sessions.push_back(session);
  next_sweep_ = Instant::max();
  Instant next = now.instant + sweep_period_;
  for (const auto& session : sessions) {
    session->Sweep(now);
    next = std::min(next, session->Deadline().value_or(next));
  }
  SweepAt(next);
}

}  // namespace baudgate::modbus
