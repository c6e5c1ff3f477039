// `Server` accepts network clients for the port of one line and decides which of them has the port.
// All calls must come from the loop of the line.
//
//   served   the line does not poll. A client gets the port as soon as it connects; further clients
//            are refused, or wait
//   lent     the line polls. Several clients can be connected; the first that sends something gets
//            the port. Silent clients stay connected, unless a new client needs their place
//
// `ClientSocket` is the TCP connection of one client.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <asio/ip/tcp.hpp>
#include <asio/steady_timer.hpp>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "config/model/line.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/lines/serial_server/session.h"
#include "transports/net_stream.h"
#include "transports/stream_pump.h"
#include "transports/tls_handshakes.h"

namespace baudgate::serial_server {

class ClientSocket final : public Session::Connection {
 public:
  /// A client that takes no data for this time is disconnected. TCP has the same limit
  /// (transports/listen_socket.h).
  static constexpr Duration kStall = 15s;

  struct Events {
    std::function<void(View)> bytes;
    /// The client sends no more, or the connection has failed; `how` is a text for users.
    std::function<void(bool failed, const std::string& how)> end;
    std::function<void()> room;
  };
  /// No function of `events` is called after the destruction, or from within a call of this object.
  ClientSocket(tls::NetStream stream, Events events);
  ~ClientSocket();
  ClientSocket(const ClientSocket&) = delete;
  ClientSocket& operator=(const ClientSocket&) = delete;

  void Start() { pump_->Start(); }
  void Send(View bytes) override { pump_->Send(bytes); }
  std::size_t unsent() const override { return pump_->unsent(); }
  void Pause(bool paused) override { pump_->Pause(paused); }
  /// True if the client has closed its side, even if this was not reported yet.
  bool HasLeft();

 private:
  std::shared_ptr<transports::StreamPump<tls::NetStream>> pump_;
};

class Server final : public PortUser {
 public:
  /// The maximum number of clients at a time, including the client that has the port.
  static constexpr std::size_t kMostClients = 8;
  static constexpr Duration kTryEvery = 1s;

  enum class Use : std::uint8_t {
    served,
    lent,
    by_hand,  ///< lent by `release --tcp`
  };

  /// `line` is the name of the line. `io` and `owner` must outlive the server.
  Server(asio::io_context& io, config::PortServer config, Use use, std::string line,
         PortOwner& owner);
  ~Server() { Stop(); }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// Listens at the configured address; if this fails, tries again once a second until Stop.
  /// Reports also when this machine loses the address, and when it has the address again.
  void Start();
  /// Stops listening and disconnects all clients, without a call of PortOwner::Return.
  void Stop();

  void Grant(transports::Transport& port, const config::SerialSettings& serial, Now now) override;
  void TakeBack(Now now) override;
  void OnPort(View bytes, Now now) override;
  void OnPortRoom() override;
  Visit visit() const override;

 private:
  struct Client {
    std::string name;
    std::unique_ptr<ClientSocket> socket;
    std::optional<Session> session;  // empty: the client waits for its turn
    Bytes early;                     // bytes that the client sent before it had a session
    bool has_ended = false;  // true: the client has closed its side and sends nothing after `early`
  };
  using Clients = std::list<Client>;

  Status Listen();
  void Accept();
  void Look();
  void Later(asio::steady_timer& timer, Duration wait, void (Server::*then)());
  void Welcome(asio::ip::tcp::socket socket);
  void BeginTls(asio::ip::tcp::socket socket, const asio::ip::tcp::endpoint& peer);
  void Admit(tls::NetStream stream, const asio::ip::tcp::endpoint& peer);
  void Refuse(const asio::ip::tcp::endpoint& peer, const std::string& why);
  std::optional<std::string> WhyNot(const asio::ip::tcp::endpoint& peer);
  bool MakeRoom();
  bool IsSilent(const Client& client) const;
  void RefuseWaiting(Now now);
  void BeginSession(Client& client, Now now);
  void Want(Client& client, Now now);
  void OnBytes(Client& client, View bytes);
  void OnEnd(Client& client, bool failed, const std::string& how);
  void Settle(Client& client, Now now);
  void Leave(Client& client, std::string why, Now now);
  void Remove(Client& client);
  void AdmitNext(Now now);
  void Arm();
  void OnTimer();

  const config::PortServer config_;
  const Use use_;
  const std::string line_;
  PortOwner& owner_;
  asio::io_context& io_;
  const std::shared_ptr<tls::ContextFiles> tls_;
  // The clients whose TLS handshake has not ended, by number.
  std::map<std::uint64_t, tls::Handshakes::Ticket> newcomers_;
  std::uint64_t next_newcomer_ = 0;
  asio::ip::tcp::acceptor acceptor_;
  asio::steady_timer look_;
  asio::steady_timer retry_;  // accepts again after an error
  asio::steady_timer timer_;
  Instant armed_ = Instant::max();
  Clients clients_;
  Client* holder_ = nullptr;  // the client that asks for the port, or has it
  // The last reported trouble of listening; empty: nothing was reported yet.
  std::optional<std::string> told_;
  std::shared_ptr<char> running_;
};

}  // namespace baudgate::serial_server
