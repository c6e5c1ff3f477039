// One connected Modbus TCP client: takes its requests in their order and sends the answers.
// Bytes come from and go to its socket; what they mean is decided by service.h.
// All on the server's thread. A client can delay nobody: a turn answers a few frames, answers that
// it does not read stop its own requests, and memory is bounded.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "config/config.h"
#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "gateway/modbus/client_poll.h"
#include "gateway/modbus/mbap.h"
#include "gateway/modbus/request.h"
#include "gateway/modbus/service.h"

namespace baudgate::modbus {

class ModbusSession final : public ClientPoll::Client,
                            public std::enable_shared_from_this<ModbusSession> {
 public:
  /// Owns `socket`, which is connected and non-blocking. `closed` is called once, at the end.
  /// Clients, listener and service outlive every session that is not closed.
  ModbusSession(int socket, ClientPoll& clients, const config::Listener& listener, Service& service,
                std::string peer, Instant now, std::function<void(ModbusSession&)> closed);
  ~ModbusSession();
  ModbusSession(const ModbusSession&) = delete;
  ModbusSession& operator=(const ModbusSession&) = delete;

  void Start();
  void Close();
  /// Closes an idle or stalled client and answers writes whose deadline has passed.
  void Sweep(Instant now);

 private:
  /// A write that a line has not answered yet.
  struct Pending {
    std::uint64_t id = 0;
    Instant deadline;
    Bytes frame;
  };

  void OnEvents(std::uint32_t events) override;
  void Watch(std::uint32_t events);
  void Release();
  void Receive();
  /// Answers the frames at hand, at most a few.
  void Turn();
  /// Waits for what comes next: room for answers, more frames at hand, or bytes from the client.
  void Continue();
  void Handle(View frame, Instant now);
  ExceptionCode StartWrite(const ModbusRequest& request, Instant now);
  void FinishWrite(std::uint64_t id, Outcome outcome);
  void Answer(const ModbusRequest& request);
  void Refuse(View frame, ExceptionCode exception);
  void Flush();
  void CloseMalformed(Instant now);
  void CloseStalled(Instant now, std::string_view why);

  int socket_;
  ClientPoll& clients_;
  const config::Listener& listener_;
  Service& service_;
  std::string peer_;
  std::function<void(ModbusSession&)> on_closed_;
  MbapAssembler assembler_;
  Bytes out_;             ///< answers that are not sent yet
  bool blocked_ = false;  ///< the client's buffers are full: nothing is read or answered
  std::vector<Pending> pending_;
  std::uint64_t next_id_ = 0;
  Instant last_frame_;
  Instant blocked_since_;
  std::uint32_t watched_ = 0;  ///< events that the poll knows of
  bool turn_posted_ = false;
  bool closed_ = false;
};

}  // namespace baudgate::modbus
