// One connected client of Modbus TCP, or of RTU over TCP: takes its requests in their order and
// sends the answers. Bytes come from and go to its socket; what they mean is decided by
// gateway/outputs/modbus/service/client_requests.h.
// All on the server's thread, which says what time it is. A client can delay no other: a turn
// answers a few frames, answers that it does not read stop its own requests, and memory is bounded.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "config/model/outputs.h"
#include "gateway/base/bytes.h"
#include "gateway/base/log.h"
#include "gateway/base/time.h"
#include "gateway/outputs/modbus/server/client_socket.h"
#include "gateway/outputs/modbus/service/client_requests.h"
#include "gateway/outputs/modbus/service/server_shared.h"
#include "gateway/outputs/modbus/wire/client_framing.h"
#include "gateway/outputs/modbus/wire/request.h"

namespace baudgate::modbus {

// The log line about a client that was turned away or closed; called by Listener and ClientSession.

/// "10.0.0.7:40112", "refused", and why. Clients at one address are repeats of each other: their
/// ports differ every time.
inline void WarnOfClient(std::string_view peer, std::string_view what, std::string_view why) {
  const std::string_view address = peer.substr(0, peer.rfind(':'));
  log::WarnFolded(fmt::format("modbus: client {} {}", address, what), "modbus: client {} {}: {}",
                  peer, what, why);
}

class ClientSession final : public ClientPoll::Client,
                            public ClientWire,
                            public std::enable_shared_from_this<ClientSession> {
 public:
  class Owner {
   public:
    /// Once, at the end.
    virtual void OnClosed(ClientSession& session) = 0;
    /// Sweep is to be called at this time, if not before.
    virtual void SweepAt(Instant at) = 0;

   protected:
    ~Owner() = default;
  };

  /// Owns `socket`, which is connected and non-blocking. Clients, listener, `shared` and owner
  /// outlive every session that is not closed.
  ClientSession(int socket, ClientPoll& clients, const config::Listener& listener,
                ServerShared& shared, std::string peer, config::Priority priority, const Now& now,
                Owner& owner);

  void Start();
  void Close();
  /// Closes an idle or stalled client and decides what an RTU client has left unfinished. Answers
  /// requests whose deadline has passed, if the line has not done so.
  void Sweep(const Now& now);
  /// When Sweep has a request to answer. Empty: no request waits.
  std::optional<Instant> Deadline() const { return requests_.Deadline(); }

 private:
  void OnEvents(std::uint32_t events, const Now& now) override;
  void Watch(std::uint32_t events);
  void Receive(const Now& now);
  /// Takes bytes from the socket; false when there are none.
  bool Fill(Instant now);
  /// Answers the frames at hand, at most a few.
  void Turn(const Now& now);
  /// RTU: what the client has asked before this frame is not answered any more. False when it has
  /// given up this one as well.
  bool Supersede(View frame);
  /// Waits for what comes next: room for answers, more frames at hand, or bytes from the client.
  void Continue();
  void Answer(const ModbusRequest& request, Responder& responder, Instant now) override;
  void Answer(View frame, Instant now) override;
  void AnswerNothing(Instant now) override;
  void SweepAt(Instant at) override { owner_.SweepAt(at); }
  /// False when the answer could not go out like this.
  bool SendAtOnce(const ModbusRequest& request, Responder& responder);
  /// One more request is answered.
  void Answered(Instant now);
  /// Sends what is to be sent. An RTU answer waits here until it is certain that what has come
  /// behind its request is no new one.
  void Flush(Instant now);
  /// Keeps the session alive through an answer that may close it; in a turn its caller does.
  std::shared_ptr<ClientSession> Hold() { return in_turn_ ? nullptr : shared_from_this(); }
  bool CloseOther(const Now& now);
  void CloseMalformed(Instant now);
  void CloseStalled(std::string_view why);

  ClientSocket socket_;
  const config::Listener& listener_;
  ServerShared& shared_;
  std::string peer_;
  Owner& owner_;
  std::unique_ptr<ClientFraming> framing_;
  ClientRequests requests_;
  /// Sent before its first request, as much as is looked at; empty: a request has come.
  std::optional<Bytes> first_ = Bytes();
  bool in_turn_ = false;  ///< answers are flushed at its end
  Instant last_bytes_;
  Instant last_frame_;
  bool closed_ = false;
};

}  // namespace baudgate::modbus
