// What one client asks and how it is answered, whatever wire it comes by: permission, cached units,
// writes, transparent routes, exceptions, deadlines. Whole frames in their Modbus TCP form come
// from session.cpp (sockets) and serial_listener.cpp (a serial master); answers go back to them.
// All on the server's thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/any_io_executor.hpp>
#include <asio/steady_timer.hpp>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "config/model/listener.h"
#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "gateway/modbus/desk/point_desk.h"
#include "gateway/modbus/wire/request.h"
#include "gateway/requests/routed.h"

namespace baudgate::modbus {

class RequestDesk : public std::enable_shared_from_this<RequestDesk> {
 public:
  /// The way back to the client. The desk may be closed from within a call.
  class Wire {
   public:
    /// A read out of the store, or a confirmed write: the responder's private copy holds what was
    /// asked for, during the call only.
    virtual void Answer(const ModbusRequest& request, Responder& responder) = 0;
    /// A whole frame in its Modbus TCP form: an exception, a routed reply.
    virtual void Answer(View frame) = 0;
    /// A request stays without any answer (a broadcast, a silent listener): a wire that takes one
    /// request at a time goes on.
    virtual void AnswerNothing() = 0;

   protected:
    ~Wire() = default;
  };

  /// Requests of one client that may wait for lines and servers; more are answered "busy".
  static constexpr std::size_t kMaxPending = 32;
  /// Whoever has taken a request answers it at its deadline: a routed one if it was not sent, a
  /// write to a device however it stands. What is left is answered here, so much later that the
  /// other answer has its chance.
  static constexpr Duration kGrace = 20ms;

  /// Listener, points and wire outlive the desk until Close. The executor is that of the server's
  /// thread: it sweeps when a deadline has passed.
  RequestDesk(const asio::any_io_executor& executor, const config::Listener& listener,
              PointDesk& points, Wire& wire, std::string peer, config::Priority priority);

  /// One whole frame, MBAP header included: leads to exactly one call of the wire, now or later,
  /// unless it is given up before.
  void Handle(View frame, Instant now);
  /// Answers requests whose deadline has passed and that nobody has answered. Comes by itself.
  void Sweep(Instant now);
  /// The client waits for none of its requests any more: what is not on its way to a slave or
  /// device is not sent, and what was asked until now is not answered.
  void GiveUp();
  /// The client has left: what it still waits for is forgotten, and the wire is not called again.
  void Close();

  std::size_t outstanding() const { return pending_.size(); }
  std::uint64_t id() const { return record_->id; }

 private:
  /// What nobody has answered yet: a write to a device, or a routed request.
  struct Pending {
    std::uint64_t number = 0;
    Instant deadline;
    std::optional<std::size_t> route;
    Bytes frame;
    bool given_up = false;  ///< a write to a device: it goes on, but is not answered

    /// When the desk answers in the place of whoever has taken it.
    Instant Limit() const { return deadline + kGrace; }
  };

  void HandleOwn(View frame, Instant now);
  void HandleRouted(View frame, std::size_t index, Instant now);
  ExceptionCode StartWrite(const ModbusRequest& request, Instant now);
  void FinishWrite(std::uint64_t number, Outcome outcome);
  void Forward(View frame, std::size_t index, std::uint8_t slave, Instant now);
  void FinishRouted(std::uint64_t number, RoutedReply reply, const Now& now);

  void HandleBroadcast(View frame, std::size_t index, std::span<const RouteTargets::Line> lines,
                       Instant now);
  bool Broadcast(View frame, std::size_t index, const RouteTargets::Line& line, Instant now);

  std::optional<Pending> TakePending(std::uint64_t number);
  void AddPending(Pending pending);
  void Arm();
  config::Priority PriorityOf(std::uint8_t function) const;
  bool speaks_rtu() const;
  bool IsUnawaited(View request) const;
  std::size_t BytesOnWire(std::size_t frame) const;

  void Answer(const ModbusRequest& request);
  void Answer(View frame);
  void Refuse(View frame, ExceptionCode exception);

  const config::Listener& listener_;
  PointDesk& points_;
  Wire& wire_;
  config::Priority priority_;
  std::shared_ptr<ClientRecord> record_;
  std::vector<Pending> pending_;
  std::vector<RouteTarget*> used_;  ///< targets that may still hold requests of this client
  std::shared_ptr<std::atomic<bool>> given_up_;  ///< of the writes since GiveUp; null: none
  asio::steady_timer timer_;
  Instant armed_for_ = Instant::max();  ///< the timer; max: it does not run
  std::uint64_t next_number_ = 0;
  std::size_t broadcasts_ = 0;  ///< that are under way
  bool closed_ = false;
};

}  // namespace baudgate::modbus
