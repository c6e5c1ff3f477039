// Where clients come in for the port of one line, and which of them has it. All on the loop of the
// line.
//
//   served   a client has the port as soon as it is connected; others are refused, or wait
//   lent     several may be connected; the first that sends something gets the port, and the others
//            keep their connection, as long as they are silent and a newcomer does not need their
//            place
//
// ClientSocket is the TCP connection of one client.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <asio/ip/tcp.hpp>
#include <asio/steady_timer.hpp>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <string>

#include "config/model/line.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/lines/serial_server/session.h"
#include "transports/stream_pump.h"

namespace baudgate::serial_server {

// The TCP connection of one client of a port: its bytes come from here to session.h, and go back.
class ClientSocket final : public Session::Connection {
 public:
  /// A client that takes nothing for so long is disconnected; TCP itself waits no longer
  /// (transports/listen_socket.h).
  static constexpr Duration kStall = 15s;

  struct Events {
    std::function<void(View)> bytes;
    /// It sends no more, or the connection has failed; the text says how.
    std::function<void(bool failed, const std::string& how)> end;
    std::function<void()> room;
  };
  /// Nothing of `events` is called after the destruction, and nothing from within a call.
  ClientSocket(asio::ip::tcp::socket socket, Events events);
  ~ClientSocket();
  ClientSocket(const ClientSocket&) = delete;
  ClientSocket& operator=(const ClientSocket&) = delete;

  void Start() { pump_->Start(); }
  void Send(View bytes) override { pump_->Send(bytes); }
  std::size_t unsent() const override { return pump_->unsent(); }
  void Pause(bool paused) override { pump_->Pause(paused); }
  /// It has closed its side, although that was not heard yet.
  bool HasLeft();

 private:
  std::shared_ptr<transports::StreamPump<asio::ip::tcp::socket>> pump_;
};

class Server final : public PortUser {
 public:
  /// At once, the one that has the port included.
  static constexpr std::size_t kMostClients = 8;
  static constexpr Duration kTryEvery = 1s;

  enum class Use : std::uint8_t {
    served,
    lent,
    by_hand,  ///< lent by `release --tcp`
  };

  /// `line`: its name. Io and owner outlive the server.
  Server(asio::io_context& io, config::PortServer config, Use use, std::string line,
         PortOwner& owner);
  ~Server() { Stop(); }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// Listens, or tries it once a second until Stop. Reports as well when the address has left the
  /// machine, and when it is back.
  void Start();
  /// Disconnects all. The owner has nothing to give back.
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
    std::optional<Session> session;  // empty: it waits for its turn
    Bytes early;                     // what it has sent meanwhile
    bool has_ended = false;          // behind that it sends no more
  };
  using Clients = std::list<Client>;

  Status Listen();
  void Accept();
  void Look();
  void Later(asio::steady_timer& timer, Duration wait, void (Server::*then)());
  void Welcome(asio::ip::tcp::socket socket);
  std::optional<std::string> WhyNot(const asio::ip::tcp::endpoint& peer);
  bool MakeRoom();
  void BeginSession(Client& client, Now now);
  void Want(Client& client, Now now);
  void OnBytes(Client& client, View bytes);
  void OnEnd(Client& client, bool failed, const std::string& how);
  /// What follows from the last input of its session.
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
  asio::ip::tcp::acceptor acceptor_;
  asio::steady_timer look_;
  asio::steady_timer retry_;  // of accepting
  asio::steady_timer timer_;
  Instant armed_ = Instant::max();
  Clients clients_;
  Client* holder_ = nullptr;         // wants the port, or has it
  std::optional<std::string> told_;  // trouble of listening; none was told yet
  std::shared_ptr<char> running_;
};

}  // namespace baudgate::serial_server
