// One listening TCP port of the Modbus server: accepts clients that are allowed, and looks after
// them. Allows decides which clients may connect, and PassedSockets takes over sockets that systemd
// has opened.
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

namespace baudgate::modbus {

// Which clients may connect, and with which priority: `allow` and `clients` of a listener. Pure.

/// An IPv6 address, or an IPv4 one in its mapped form (::ffff:a.b.c.d).
using PeerAddress = std::array<std::uint8_t, 16>;

bool Contains(const config::Network& network, const PeerAddress& peer);

/// An empty list allows everybody.
bool Allows(std::span<const config::Network> list, const PeerAddress& peer);

/// The priority of the first client rule that fits, else the listener's.
config::Priority PriorityOf(const config::Listener& listener, const PeerAddress& peer);

// Listening sockets that systemd has opened for this process (a .socket unit), each for the
// listener of the same address. https://www.freedesktop.org/software/systemd/man/sd_listen_fds.html
class PassedSockets {
 public:
  /// Takes what the environment tells of, and clears it: children get none of it.
  PassedSockets();
  /// Closes those that no listener has taken, and names them in the log.
  ~PassedSockets();
  PassedSockets(const PassedSockets&) = delete;
  PassedSockets& operator=(const PassedSockets&) = delete;

  /// The descriptor that listens at exactly this address, which is the caller's from now on.
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
  /// `shared` outlives the listener until Stop.
  Listener(asio::io_context& io, config::Listener listener, ServerShared& shared);

  /// Opens the port, at which clients wait until Start: at a socket of `passed` where there is one
  /// for its address, else at its own. From any thread; without Start it may be dropped. The error
  /// says why, and what to do.
  Status Open(PassedSockets* passed = nullptr);
  void Start();
  /// A reload: other settings of the same place. The port stays open; clients are disconnected.
  void Renew(const config::Listener& listener);
  void Stop();
  /// The error: why no client can come in now.
  Status HasAddress() const { return transports::HasAddressOf(acceptor_); }
  /// "Modbus TCP on 0.0.0.0:502".
  std::string Summary() const;
  /// The port that is really listened on; differs from the configured one only when that is 0.
  std::uint16_t port() const { return port_; }

 private:
  void CloseClients();
  void Accept();
  void Welcome(asio::ip::tcp::socket socket);
  std::size_t MostClients() const;
  void Refuse(std::string_view peer, std::string_view why);
  void AcceptLater(const asio::error_code& why);
  void OnClosed(ClientSession& session) override;
  void SweepAt(Instant at) override;
  void Sweep(const Now& now);

  asio::ip::tcp::acceptor acceptor_;
  std::shared_ptr<ClientPoll> clients_;
  asio::steady_timer retry_;
  asio::steady_timer sweep_;
  config::Listener listener_;  // sessions look at it
  ServerShared& shared_;
  std::unordered_map<const ClientSession*, std::shared_ptr<ClientSession>> sessions_;
  Duration sweep_period_;
  Instant next_sweep_ = Instant::max();
  std::uint16_t port_ = 0;
  bool stopped_ = false;
};

}  // namespace baudgate::modbus
