// The TCP connection of one client of a port: its bytes come from here to session.h, and go back.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/ip/tcp.hpp>
#include <functional>
#include <memory>
#include <system_error>

#include "gateway/lines/serial_server/session.h"
#include "transports/stream_pump.h"

namespace baudgate::serial_server {

class ClientSocket final : public Session::Connection {
 public:
  /// A client that takes nothing for so long is disconnected; TCP itself waits no longer
  /// (transports/tcp_watch.h).
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
  std::shared_ptr<StreamPump<asio::ip::tcp::socket>> pump_;
};

}  // namespace baudgate::serial_server
