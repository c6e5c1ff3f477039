// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/server/listener.h"

#include <sys/socket.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <algorithm>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "gateway/base/fair_places.h"
#include "gateway/base/log.h"
#include "gateway/outputs/modbus/server/client_session.h"

namespace baudgate::modbus {

namespace {

constexpr std::size_t kIpv4At = 12;
constexpr int kIpv4Prefix = 96;

bool SamePrefix(const PeerAddress& a, const PeerAddress& b, int from, int to) {
  for (int bit = from; bit < to; ++bit) {
    const auto byte = static_cast<std::size_t>(bit / 8);
    if ((((a[byte] ^ b[byte]) >> (7 - bit % 8)) & 1) != 0) return false;
  }
  return true;
}

bool IsMapped(const PeerAddress& peer) {
  constexpr std::array<std::uint8_t, kIpv4At> kMapped = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xFF, 0xFF};
  return std::equal(kMapped.begin(), kMapped.end(), peer.begin());
}

/// True for an IPv4 network, whose text contains no colon.
bool IsIpv4(const config::Network& network) {
  return network.prefix >= kIpv4Prefix && network.text.find(':') == std::string::npos;
}

}  // namespace

bool Contains(const config::Network& network, const PeerAddress& peer) {
  const int prefix = std::clamp(network.prefix, 0, 128);
  if (!IsIpv4(network)) return SamePrefix(peer, network.bytes, 0, prefix);
  return IsMapped(peer) && SamePrefix(peer, network.bytes, kIpv4Prefix, prefix);
}

bool Allows(std::span<const config::Network> list, const PeerAddress& peer) {
  if (list.empty()) return true;
  return std::ranges::any_of(
      list, [&](const config::Network& network) { return Contains(network, peer); });
}

config::Priority PriorityOf(const config::Listener& listener, const PeerAddress& peer) {
  for (const config::ClientPriority& rule : listener.clients) {
    if (Contains(rule.from, peer)) return rule.priority;
  }
  return listener.priority;
}

std::optional<std::size_t> ClosedForRoom(std::span<const OpenConnection> open, std::uint64_t host,
                                         Instant now) {
  constexpr Duration kIdle = 10s;
  std::unordered_map<std::uint64_t, std::size_t> connections;
  for (const OpenConnection& one : open) ++connections[one.host];
  const std::size_t own = connections[host];
  std::optional<std::size_t> closed;
  bool is_of_large = false;  // `closed` belongs to a host with two connections more
  for (std::size_t i = 0; i < open.size(); ++i) {
    const OpenConnection& one = open[i];
    const std::size_t its = connections[one.host];
    const bool large = its >= own + 2;
    const bool is_idle = !one.has_pending && now - one.idle_since >= kIdle;
    const bool may_close = large || (is_idle && (its == own + 1 || one.host == host));
    if (!may_close || (is_of_large && !large)) continue;
    if (!closed || (large && !is_of_large) || one.idle_since < open[*closed].idle_since) {
      closed = i;
      is_of_large = large;
    }
  }
  return closed;
}

namespace {

using asio::ip::tcp;

std::optional<tcp::endpoint> EndpointOf(int descriptor) {
  tcp::endpoint endpoint;
  auto size = static_cast<socklen_t>(endpoint.capacity());
  if (::getsockname(descriptor, endpoint.data(), &size) != 0) return std::nullopt;
  const auto family = endpoint.data()->sa_family;
  if (family != AF_INET && family != AF_INET6) return std::nullopt;
  endpoint.resize(size);
  return endpoint;
}

std::string TextOf(const tcp::endpoint& endpoint) {
  std::ostringstream text;
  text << endpoint;
  return text.str();
}

}  // namespace

PassedSockets::PassedSockets() {
  const int count = sd_listen_fds(1);
  for (int fd = SD_LISTEN_FDS_START; fd < SD_LISTEN_FDS_START + count; ++fd) {
    const bool listens = sd_is_socket(fd, AF_UNSPEC, SOCK_STREAM, 1) > 0;
    const auto endpoint = listens ? EndpointOf(fd) : std::nullopt;
    if (endpoint) {
      passed_.push_back({fd, *endpoint});
    } else {
      log::Warn(
          "modbus: systemd has passed descriptor {}, which is not a listening TCP socket; the "
          "gateway closes it",
          fd);
      ::close(fd);
    }
  }
}

PassedSockets::~PassedSockets() {
  for (const Passed& one : passed_) {
    log::Warn(
        "modbus: systemd has passed a socket at {}, which is not in modbus.listen; the gateway "
        "closes it. Give baudgate.socket and modbus.listen the same addresses",
        TextOf(one.endpoint));
    ::close(one.descriptor);
  }
}

std::optional<int> PassedSockets::Take(const tcp::endpoint& endpoint) {
  const auto found = std::ranges::find(passed_, endpoint, &Passed::endpoint);
  if (found == passed_.end()) return std::nullopt;
  const int descriptor = found->descriptor;
  passed_.erase(found);
  return descriptor;
}

namespace {

using asio::ip::tcp;

/// Pause before accept() is called again when file descriptors or memory are missing. Without it,
/// accept() would be called in an endless loop.
constexpr Duration kAcceptPause = 100ms;
/// How often incomplete frames of RTU and ASCII clients are checked.
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

std::shared_ptr<tls::ContextFiles> TlsOf(const config::Listener& listener) {
  if (listener.protocol != config::Listener::Protocol::tls) return nullptr;
  return std::make_shared<tls::ContextFiles>(tls::End::server, listener.tls);
}

}  // namespace

Listener::Listener(asio::io_context& io, config::Listener listener, ServerShared& shared)
    : acceptor_(io),
      clients_(std::make_shared<ClientPoll>(io)),
      retry_(io),
      sweep_(io),
      listener_(std::move(listener)),
      shared_(shared),
      tls_(TlsOf(listener_)),
      sweep_period_(SweepPeriodOf(listener_, shared.limits())) {}

Status Listener::Open(PassedSockets* passed) {
  if (tls_) {
    if (const auto context = tls_->Current(); !context) return Error{context.error()};
  }
  asio::error_code failed;
  tcp::resolver resolver(acceptor_.get_executor());
  const auto found =
      resolver.resolve(listener_.host, std::to_string(listener_.port),
                       tcp::resolver::passive | tcp::resolver::numeric_service, failed);
  if (failed || found.empty()) {
    return Error{"the host is unknown; check modbus.listen"};
  }
  const tcp::endpoint endpoint = found.begin()->endpoint();
  const auto descriptor = passed == nullptr ? std::nullopt : passed->Take(endpoint);
  if (descriptor) {
    acceptor_.assign(endpoint.protocol(), *descriptor, failed);
    if (failed) return Error{failed.message()};
    log::Info("modbus: {}: the socket was passed by systemd", listener_.Address());
  } else if (Status bound = transports::Listen(acceptor_, endpoint, "modbus.listen"); !bound) {
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
  return std::string(Title(listener_.framing)) +
         (listener_.speaks_serial() ? " over TCP"
          : tls_                    ? " with TLS"
                                    : "") +
         " on " + listener_.host + ":" + std::to_string(port_);
}

void Listener::Renew(const config::Listener& listener) {
  CloseClients();
  listener_ = listener;
  tls_ = TlsOf(listener_);
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
  newcomers_.clear();
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
  log::Warn("modbus: no client can be accepted at {}: {}", listener_.Address(), why.message());
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
    return Refuse(name, "its address is not in 'allow' of this listener (modbus.listen)");
  }
  asio::error_code failed;
  socket.set_option(tcp::no_delay(true), failed);
  socket.set_option(asio::socket_base::keep_alive(true), failed);
  socket.non_blocking(true, failed);
  if (failed) return;
  const int owned = socket.release(failed);
  if (failed) return;
  if (tls_) return BeginTls(owned, name, address);
  Admit({.socket = owned, .peer = name}, address);
}

void Listener::BeginTls(int owned, const std::string& peer, const PeerAddress& address) {
  const std::uint64_t number = next_newcomer_++;
  Newcomer& newcomer = newcomers_[number];
  newcomer.peer = peer;
  newcomer.address = address;
  newcomer.ticket = tls::Handshakes::OfProcess().Begin(
      owned, tls_, peer, static_cast<asio::io_context&>(acceptor_.get_executor().context()),
      [this, number](Result<std::unique_ptr<tls::Channel>> result) {
        EndTls(number, std::move(result));
      });
}

void Listener::EndTls(std::uint64_t number, Result<std::unique_ptr<tls::Channel>> result) {
  const auto found = newcomers_.find(number);
  if (found == newcomers_.end()) return;
  const auto self = shared_from_this();
  const std::string peer = found->second.peer;
  const PeerAddress address = found->second.address;
  newcomers_.erase(found);
  const WallTime now = ReadClocks().wall;
  const std::string what = "Modbus with TLS at " + listener_.Address();
  if (!result) {
    shared_.Note({"login", "", HostOf(peer), what, result.error()}, now);
    return Refuse(peer, result.error());
  }
  const tls::Identity identity = (*result)->peer();
  const auto role = std::ranges::find(listener_.roles, identity.role, &config::RoleRights::role);
  const bool has_rights = !identity.role.empty() && role != listener_.roles.end();
  const std::string none = identity.role.empty()
                               ? "the certificate contains no role"
                               : "the role '" + identity.role + "' has no rights at this listener";
  const std::string why = !identity.trouble.empty() ? identity.trouble : has_rights ? "" : none;
  shared_.Note({"login", identity.Name(), HostOf(peer), what,
                why.empty() ? "ok, role " + identity.role : why},
               now);
  if (!why.empty()) WarnOfClient(peer, "may send no request", why + "; see roles in modbus.listen");
  Accepted accepted{.peer = peer + " " + identity.Name(), .rights = has_rights ? &*role : nullptr};
  accepted.socket = (*result)->Release();
  accepted.channel = std::move(*result);
  Admit(std::move(accepted), address);
}

void Listener::Admit(Accepted accepted, const PeerAddress& address) {
  if (sessions_.size() >= MostClients() && !MakeRoom(accepted.peer, ReadClocks().instant)) {
    Refuse(accepted.peer,
           shared_.limits().client_share < 1
               ? "no file descriptor is left for another client; raise LimitNOFILE of the service"
               : "max_clients are connected already; raise max_clients of the listener");
    ::close(accepted.socket);
    return;
  }
  LiveCounters& counters = shared_.counters();
  LiveCounters::Add(counters.accepted);
  counters.clients.fetch_add(1, std::memory_order_relaxed);
  const Now now = ReadClocks();
  shared_.NoteHost(accepted.peer, listener_.Address(), now.wall);
  accepted.priority = PriorityOf(listener_, address);
  auto session = std::make_shared<ClientSession>(std::move(accepted), *clients_, listener_, shared_,
                                                 now, *this);
  sessions_.emplace(session.get(), session);
  session->Start();
}

std::size_t Listener::MostClients() const {
  const double most = listener_.max_clients * shared_.limits().client_share;
  return std::max<std::size_t>(static_cast<std::size_t>(most), 1);
}

bool Listener::MakeRoom(std::string_view newcomer, Instant now) {
  std::vector<std::shared_ptr<ClientSession>> sessions;
  std::vector<OpenConnection> open;
  for (const auto& [key, session] : sessions_) {
    sessions.push_back(session);
    open.push_back({session->host(), session->idle_since(), session->has_pending()});
  }
  const auto closed = ClosedForRoom(open, HostNumberOf(newcomer), now);
  if (closed) sessions[*closed]->CloseForRoom();
  return closed.has_value();
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
