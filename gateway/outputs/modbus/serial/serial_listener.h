// A serial port at which a Modbus master waits for its slaves: the port, its timer and the
// clock. What is said there goes to master_session.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <asio/steady_timer.hpp>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include "config/model/listener.h"
#include "gateway/outputs/modbus/serial/master_session.h"
#include "gateway/outputs/modbus/service/server_shared.h"
#include "transports/port_thread.h"

namespace baudgate::modbus {

/// All on the server's thread. Made by make_shared.
class SerialListener final : public std::enable_shared_from_this<SerialListener>,
                             private PortThread::Owner,
                             public MasterSession::Owner {
 public:
  /// `shared` outlives the listener until Stop. See MasterSession for the protocol.
  SerialListener(asio::io_context& io, config::Listener listener, ServerShared& shared);
  ~SerialListener() { Stop(); }

  /// A port that is absent or cannot be opened is tried again until Stop.
  void Open() { port_.Start(); }
  /// Nothing is heard or answered any more; the port is still open.
  void Leave();
  /// Closes the port, which may take its driver long: after Leave from any other thread, too. The
  /// listener is destroyed on the server's thread even then.
  void ClosePort() { port_.Stop(); }
  /// Both.
  void Stop();

  /// "a Modbus master on /dev/ttyS1".
  std::string Summary() const { return "a Modbus master on " + listener_.path; }

 private:
  void OnOpened(const std::string& description) override;
  void OnDown(const std::string& reason, bool is_news) override;
  void OnBytes(View bytes, Instant at) override;

  void Send(Bytes frame) override { port_.Send(std::move(frame)); }
  void Rearm() override;

  const config::Listener listener_;
  ServerShared& shared_;
  TrafficBook& book_;
  PortThread port_;
  const std::size_t place_;  ///< in the traffic book, once it has its thread
  bool left_ = false;
  asio::steady_timer timer_;              // the session's deadline
  std::optional<MasterSession> session_;  // while the port is open
};

}  // namespace baudgate::modbus
