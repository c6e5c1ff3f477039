// What one client asks and how it is answered, whatever wire it comes by: permission, cached units,
// writes, transparent routes, exceptions, deadlines. Whole frames in their Modbus TCP form come
// from gateway/modbus/server/client_session.cpp (sockets) and
// gateway/modbus/serial/master_session.cpp (a serial master); answers go back to them. All on the
// server's thread; the time is an argument.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "config/model/listener.h"
#include "gateway/audit/routed_record.h"
#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "gateway/modbus/service/server_shared.h"
#include "gateway/modbus/wire/request.h"
#include "gateway/requests/routed.h"

namespace baudgate::modbus {

class RequestService : public std::enable_shared_from_this<RequestService> {
 public:
  /// The way back to the client. The service may be closed from within a call.
  class Wire {
   public:
    /// A read out of the store: the responder's private copy holds what was asked for, during the
    /// call only.
    virtual void Answer(const ModbusRequest& request, Responder& responder, Instant now) = 0;
    /// A whole frame in its Modbus TCP form: a confirmed write, an exception, a routed reply.
    virtual void Answer(View frame, Instant now) = 0;
    /// A request gets no answer (a broadcast, a silent listener): a wire that takes one request at
    /// a time goes on.
    virtual void AnswerNothing(Instant now) = 0;
    /// Call Sweep at this time, or earlier. Calls add up; none replaces an earlier one.
    virtual void SweepAt(Instant at) = 0;

   protected:
    ~Wire() = default;
  };

  /// Requests of one client that may wait for lines and servers; more are answered "busy".
  static constexpr std::size_t kMaxPending = 32;
  /// At its deadline the line answers what it has not sent, and a write that is confirmed. What is
  /// on the wire then is answered here this much later; the record of a write gets the end that
  /// comes.
  static constexpr Duration kGrace = 20ms;

  /// Listener, `shared` and wire outlive the service until Close.
  RequestService(const config::Listener& listener, ServerShared& shared, Wire& wire,
                 const std::string& peer, config::Priority priority, const Now& now);

  /// One whole frame, MBAP header included: leads to exactly one call of the wire, now or later,
  /// unless it is given up before.
  void Handle(View frame, const Now& now);
  /// Answers requests whose deadline has passed without an answer.
  void Sweep(const Now& now);
  /// The client waits for none of its requests any more. What is not on the wire is not sent: a
  /// routed request by RouteTarget::Abandon, a write by WriteCommand::abandoned. None is answered.
  void Abandon();
  /// The client has left: Abandon, and what is kept of it is forgotten (selections and its place
  /// among the events by LocalUnits::Forget, its entry in the traffic book). The wire is not
  /// called again.
  void Close();

  std::size_t outstanding() const { return pending_.size(); }
  /// When Sweep has something to answer; empty: nothing waits.
  std::optional<Instant> Deadline() const;
  /// The number of the client, as its requests carry it.
  std::uint64_t id() const { return record_->id; }

 private:
  /// A request that is not answered yet: a write to a device, or a routed request.
  struct Pending {
    std::uint64_t number = 0;
    Instant deadline;
    std::optional<std::size_t> route;  ///< its number; none: a write to a device
    /// The beginning of the request: to the function code; of a write all that its good answer
    /// repeats of it.
    Bytes frame;
    bool abandoned = false;  ///< a write to a device: it goes on, but is not answered

    /// When the service answers it itself.
    Instant Limit() const { return deadline + kGrace; }
  };

  void HandleOwn(View frame, const Now& now);
  void HandleRouted(View frame, std::size_t index, const Now& now);
  ExceptionCode StartWrite(const ModbusRequest& request, Instant now);
  void FinishWrite(std::uint64_t number, const WriteResult& result, Instant now);
  void Forward(View frame, std::size_t index, std::uint8_t slave, const Now& now);
  void FinishRouted(std::uint64_t number, RoutedReply reply, const Now& now);

  void HandleBroadcast(View frame, std::size_t index, std::span<const RouteTargets::Line> lines,
                       const Now& now);
  bool Broadcast(View frame, std::size_t index, const RouteTargets::Line& line, const Now& now);

  /// The witness of a routed request that may write, where those are recorded; else null.
  std::shared_ptr<audit::Witness> WitnessOf(View frame, const RouteTarget* target, const Now& now,
                                            bool broadcast = false) const;

  std::optional<Pending> TakePending(std::uint64_t number);
  void AddPending(Pending pending);
  config::Priority PriorityOf(std::uint8_t function) const;
  Writer writer() const { return {record_->peer, record_->id}; }
  bool IsUnawaited(View request) const;
  std::size_t BytesOnWire(std::size_t frame) const;

  void Answer(const ModbusRequest& request, Instant now);
  void Answer(View frame, Instant now);
  void Refuse(View frame, ExceptionCode exception, Instant now);

  const config::Listener& listener_;
  ServerShared& shared_;
  Wire& wire_;
  config::Priority priority_;
  std::shared_ptr<ClientRecord> record_;
  std::vector<Pending> pending_;
  std::vector<RouteTarget*> used_;  ///< targets that may still hold requests of this client
  std::shared_ptr<std::atomic<bool>> abandoned_;  ///< of the writes since Abandon; null: none
  std::uint64_t next_number_ = 0;
  std::size_t broadcasts_ = 0;  ///< that are under way
  bool closed_ = false;
};

}  // namespace baudgate::modbus
