// One listening TCP port of the Modbus server: accepts clients that are allowed, and looks after
// them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/ip/tcp.hpp>
#include <asio/steady_timer.hpp>
#include <cstdint>
#include <memory>
#include <unordered_map>

#include "config/model/listener.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/modbus/desk/point_desk.h"
#include "gateway/modbus/server/client_poll.h"
#include "gateway/modbus/server/client_session.h"
#include "gateway/modbus/server/passed_sockets.h"

namespace baudgate::modbus {

class Listener final : public std::enable_shared_from_this<Listener>, public ClientSession::Owner {
 public:
  /// Configuration and points outlive the listener until Stop.
  Listener(asio::io_context& io, const config::Listener& listener, PointDesk& points);

  /// At a socket of `passed` where there is one for its address; else it opens its own.
  Status Open(PassedSockets& passed);
  void Stop();
  /// The port that is really listened on; differs from the configured one only when that is 0.
  std::uint16_t port() const { return port_; }

 private:
  Status Bind(const asio::ip::tcp::endpoint& endpoint);
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
  const config::Listener& listener_;
  PointDesk& points_;
  std::unordered_map<const ClientSession*, std::shared_ptr<ClientSession>> sessions_;
  Duration sweep_period_;
  Instant next_sweep_ = Instant::max();
  std::uint16_t port_ = 0;
  bool stopped_ = false;
};

}  // namespace baudgate::modbus
