// One listening TCP port of the Modbus server: accepts clients that are allowed, and looks after
// them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/ip/tcp.hpp>
#include <asio/steady_timer.hpp>
#include <cstdint>
#include <memory>
#include <string>
#include <unordered_map>

#include "config/model/listener.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/outputs/modbus/server/client_poll.h"
#include "gateway/outputs/modbus/server/client_session.h"
#include "gateway/outputs/modbus/server/passed_sockets.h"
#include "gateway/outputs/modbus/service/server_shared.h"
#include "transports/listen_socket.h"

namespace baudgate::modbus {

class Listener final : public std::enable_shared_from_this<Listener>, public ClientSession::Owner {
 public:
  /// Points outlive the listener until Stop.
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
  Status HasAddress() const { return HasAddressOf(acceptor_); }
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
