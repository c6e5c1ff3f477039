// `Listener` is one listening TCP port of the Modbus server: it accepts the clients that are
// allowed, and calls their Sweep. `Allows` decides which clients may connect, and `PassedSockets`
// contains sockets that systemd has opened.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <asio/ip/tcp.hpp>
#include <asio/steady_timer.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "config/model/outputs.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/outputs/modbus/server/client_session.h"
#include "gateway/outputs/modbus/service/client_requests.h"
#include "transports/listen_socket.h"
#include "transports/tls_handshakes.h"

namespace baudgate::modbus {

/// An IPv6 address, or an IPv4 address in the mapped form ::ffff:a.b.c.d.
using PeerAddress = std::array<std::uint8_t, 16>;

bool Contains(const config::Network& network, const PeerAddress& peer);

bool Allows(std::span<const config::Network> list, const PeerAddress& peer);

/// Returns the priority of the first client rule that contains the peer; if there is none, the
/// listener's.
config::Priority PriorityOf(const config::Listener& listener, const PeerAddress& peer);

/// A client's connection, as far as ClosedForRoom needs it.
struct OpenConnection {
  std::uint64_t host = 0;    ///< HostNumberOf
  Instant idle_since{};      ///< time of the latest request, or of the connection
  bool has_pending = false;  ///< a request waits for its reply
};

/// Returns which connection is closed to make room for a new connection of `host`: the one that has
/// sent no request for the longest time, among those that may be closed. Empty: none may be closed,
/// so the new connection is refused. A connection may be closed
///
///   if its host has                                when
///   two connections more than `host`, or more      always, and before all others
///   one connection more, or is `host` itself       idle for 10 s, and no request is pending
///   another number of connections                  never
///
std::optional<std::size_t> ClosedForRoom(std::span<const OpenConnection> open, std::uint64_t host,
                                         Instant now);

// `PassedSockets` contains the listening sockets that systemd has opened for this process (.socket
// unit). A listener takes the socket of its address.
// https://www.freedesktop.org/software/systemd/man/sd_listen_fds.html
class PassedSockets {
 public:
  /// Takes the sockets that the environment lists, and clears the list, so that child processes do
  /// not get it.
  PassedSockets();
  /// Closes the sockets that no listener has taken, and logs their addresses.
  ~PassedSockets();
  PassedSockets(const PassedSockets&) = delete;
  PassedSockets& operator=(const PassedSockets&) = delete;

  std::optional<int> Take(const asio::ip::tcp::endpoint& endpoint);

 private:
  struct Passed {
    int descriptor;
    asio::ip::tcp::endpoint endpoint;
  };
  std::vector<Passed> passed_;
};

class Listener final : public std::enable_shared_from_this<Listener>, public ClientSession::Owner {
 public:
  /// `shared` must outlive the listener until Stop.
  Listener(asio::io_context& io, config::Listener listener, ServerShared& shared);

  /// Opens the port; clients that connect wait until Start. Uses the socket in `passed` for this
  /// address if there is one. Any thread may call Open; the object can be destroyed without Start.
  /// The error contains the reason and, if there is one, the remedy.
  Status Open(PassedSockets* passed = nullptr);
  void Start();
  /// Applies the new settings of a reload at the same address. The port stays open; its clients are
  /// disconnected.
  void Renew(const config::Listener& listener);
  void Stop();
  /// Returns the reason why no client can connect now as an error.
  Status HasAddress() const { return transports::HasAddressOf(acceptor_); }
  /// Returns e.g. "Modbus TCP on 0.0.0.0:502".
  std::string Summary() const;
  /// The port that is open. It differs from the configured port only if the configured port is 0.
  std::uint16_t port() const { return port_; }

 private:
  void CloseClients();
  void Accept();
  void Welcome(asio::ip::tcp::socket socket);
  void BeginTls(int owned, const std::string& peer, const PeerAddress& address);
  void EndTls(std::uint64_t number, Result<std::unique_ptr<tls::Channel>> result);
  /// Begins a session, if there is room. `accepted.peer` begins with the client's address.
  void Admit(Accepted accepted, const PeerAddress& address);
  std::size_t MostClients() const;
  bool MakeRoom(std::string_view newcomer, Instant now);
  void Refuse(std::string_view peer, std::string_view why);
  void AcceptLater(const asio::error_code& why);
  void OnClosed(ClientSession& session) override;
  void SweepAt(Instant at) override;
  void Sweep(const Now& now);

  asio::ip::tcp::acceptor acceptor_;
  std::shared_ptr<ClientPoll> clients_;
  asio::steady_timer retry_;
  asio::steady_timer sweep_;
  config::Listener
      // Sessions refer to it, so it changes only while there are no sessions.
      listener_;
  ServerShared& shared_;
  /// A client whose TLS handshake has not ended.
  struct Newcomer {
    std::string peer;
    PeerAddress address{};
    tls::Handshakes::Ticket ticket{};
  };
  std::shared_ptr<tls::ContextFiles> tls_;  // null: the port is not encrypted
  std::unordered_map<std::uint64_t, Newcomer> newcomers_;
  std::uint64_t next_newcomer_ = 0;
  std::unordered_map<const ClientSession*, std::shared_ptr<ClientSession>> sessions_;
  Duration sweep_period_;
  Instant next_sweep_ = Instant::max();
  std::uint16_t port_ = 0;
  bool stopped_ = false;
};

}  // namespace baudgate::modbus
