// A serial port at which a Modbus RTU master waits for its slaves: requests that are heard there go
// to request_desk.h in their Modbus TCP form, and its answers go back as RTU frames. Other slaves
// may answer on the same bus.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <asio/steady_timer.hpp>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "config/model/listener.h"
#include "gateway/line/assembler.h"
#include "gateway/modbus/desk/point_desk.h"
#include "gateway/modbus/desk/request_desk.h"
#include "gateway/modbus/serial/reply_echo.h"
#include "protocols/protocol.h"
#include "transports/port_thread.h"

namespace baudgate::modbus {

/// All on the server's thread. Made by make_shared. The master has one request at a time: when it
/// sends another before it was answered, it has given up, and the old answer is dropped.
class SerialListener final : public std::enable_shared_from_this<SerialListener>,
                             public RequestDesk::Wire,
                             private PortThread::Owner {
 public:
  /// Configuration, points and protocol outlive the listener until Stop. `rtu` has a carrier.
  SerialListener(asio::io_context& io, const config::Listener& listener, PointDesk& points,
                 const Protocol& rtu);
  ~SerialListener() { Stop(); }

  /// A port that is absent or can not be opened is tried again until Stop.
  void Open();
  void Stop();

  bool is_open() const { return desk_ != nullptr; }

 private:
  void OnOpened(const std::string& description) override;
  void OnDown(const std::string& reason, bool is_news) override;
  void OnBytes(View bytes, Instant at) override;

  void Answer(const ModbusRequest& request, Responder& responder) override;
  void Answer(View frame) override;
  void AnswerNothing() override { awaited_.reset(); }

  void Forget();

  void CutFrames(bool silent);
  void OnFrame(const Bytes& frame);
  void OnDoubt(const Bytes& frame, std::uint8_t unit, std::uint8_t function);
  bool HoldsBytes() const { return assembler_.held() > 0 || echo_.holding(); }
  void Arm();
  void OnTimer();
  void SendReply(Instant now);

  const config::Listener& listener_;
  PointDesk& points_;
  const std::size_t place_;  ///< in the traffic book
  const Protocol& rtu_;
  const Duration quiet_;  ///< 3.5 characters: between a request and its reply
  const Duration gap_;    ///< a frame that rests so long is not going on
  PortThread port_;
  asio::steady_timer timer_;  // the end of a gap or of the quiet before a reply

  std::shared_ptr<RequestDesk> desk_;  // while the port is open
  Assembler assembler_;
  ReplyEcho echo_;
  Instant last_byte_;
  std::uint16_t transaction_ = 0;         // of the last request
  std::optional<std::uint16_t> awaited_;  // the one that the master waits for
  Bytes request_;                         // as it came
  Bytes reply_;                           // waits for the quiet before it
};

}  // namespace baudgate::modbus
