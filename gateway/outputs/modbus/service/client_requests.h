// Handles the requests of one client of any wire: decides whether each is permitted and who answers
// it. Whole frames in their Modbus TCP form come from
// gateway/outputs/modbus/server/client_session.cpp (sockets) and
// gateway/outputs/modbus/serial/serial_listener.cpp (a serial master); answers go back to them. All
// on the server's thread; the time is an argument. ClientWire and ClientReplies are the way back to
// the client, LocalRequests and RoutedRequests handle requests, PendingRequests keeps requests that
// are not answered yet, and Permits checks `permit`. ServerShared has what all clients share; of
// it, only the book and the snapshot of the counters are used by other threads too. ModbusLinks is
// what the composition root hands to the server.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <asio/post.hpp>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "config/model/config.h"
#include "config/model/outputs.h"
#include "gateway/base/bytes.h"
#include "gateway/base/guarded.h"
#include "gateway/base/time.h"
#include "gateway/bus/writes/write_gate.h"
#include "gateway/outputs/modbus/registers/responder.h"
#include "gateway/outputs/modbus/service/own_units.h"
#include "gateway/outputs/modbus/service/router.h"
#include "gateway/outputs/modbus/service/traffic_book.h"
#include "gateway/outputs/modbus/wire/request.h"

namespace baudgate::modbus {

// The way from a line's thread to the Modbus server's: how a write or a routed request ended. It
// may outlive the server, because lines answer when they can; what comes after Close is dropped.
class Inbox {
 public:
  using Clocks = std::function<Now()>;

  /// `clocks` tells each task when it runs.
  void Open(asio::io_context& io, Clocks clocks) {
    const MutexLock lock(mutex_);
    io_ = &io;
    clocks_ = std::move(clocks);
  }
  void Close() {
    const MutexLock lock(mutex_);
    io_ = nullptr;
  }
  /// From any thread. `task` takes a `const Now&`.
  template <typename Task>
  void Post(Task task) {
    const MutexLock lock(mutex_);
    if (io_ == nullptr) return;
    asio::post(*io_, [task = std::move(task), clocks = clocks_]() mutable { task(clocks()); });
  }

 private:
  Mutex mutex_;
  asio::io_context* io_ BAUDGATE_GUARDED_BY(mutex_) = nullptr;
  Clocks clocks_ BAUDGATE_GUARDED_BY(mutex_);
};

/// Limits that are no configuration; tests shorten them.
struct ModbusLimits {
  Duration write_deadline =
      bus::kWaitForDevice;  ///< a write that is not confirmed by then is answered 0x0B
  Duration stall = 10s;     ///< a client that leaves its answers unread so long is closed
  double client_share = 1;  ///< of each listener's max_clients
};

/// What routes, RTU clients, events and alarms need beside the store; all of it outlives the
/// server.
struct ModbusLinks {
  std::vector<bus::RouteTarget*>
      lines;        ///< by index in config.lines; empty when no route leads to one
  Frames frames{};  ///< of clients that speak as on a serial line
  /// Of routed writes and acknowledgements; null: they are not recorded.
  audit::WriteLog* writes = nullptr;
  std::shared_ptr<const events::EventFeed> events{};  ///< null: none are kept
  events::EventSource* alarms = nullptr;              ///< to be acknowledged; null: likewise
  OnRoutedReport routed{};                            ///< may be null
};

// The parts that all clients of a Modbus server share: units, routes, the traffic book, the way
// back to the server's thread, limits and counters.
class ServerShared {
 public:
  ServerShared(const config::Config& config, const bus::PointStore& store, bus::CommandSink& sink,
               std::function<GatewayFigures()> info, ModbusLimits limits,
               const ModbusLinks& links = {});

  /// A reload. Clients and what they wait for stay. `routes`: which are the same.
  void Apply(const config::Config& config, std::span<bus::RouteTarget* const> lines,
             const Origins& routes);
  /// See ModbusLimits; of clients that connect from now on.
  void SetClientShare(double share) { limits_.client_share = share; }

  /// Answers of lines and servers come in from now on. `clocks` tells each when it comes.
  void Open(asio::io_context& io, Inbox::Clocks clocks);
  /// None comes in any more.
  void CloseInbox() { inbox_->Close(); }
  /// The servers elsewhere are left.
  void CloseRoutes() { router_.Close(); }

  /// The error: why nothing can be answered.
  Status Ready() { return units_.responder().ready(); }
  OwnUnits& units() { return units_; }
  Router& router() { return router_; }
  /// Which framings are spoken.
  const Frames& frames() const { return frames_; }

  LiveCounters& counters() { return counters_; }
  const LiveCounters& counters() const { return counters_; }
  const ModbusLimits& limits() const { return limits_; }
  const std::shared_ptr<Inbox>& inbox() const { return inbox_; }
  /// Shared by what may outlive the server.
  const std::shared_ptr<TrafficBook>& book() const { return book_; }

 private:
  ModbusLimits limits_;
  const std::shared_ptr<TrafficBook> book_ = std::make_shared<TrafficBook>();
  LiveCounters counters_;
  OwnUnits units_;
  Router router_;
  Frames frames_;
  const std::shared_ptr<Inbox> inbox_ = std::make_shared<Inbox>();
};

// The way back to one client: what a session implements, so that requests of its client can be
// answered now or later. On the server's thread.
class ClientWire {
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
  ~ClientWire() = default;
};

// Sends the answers to one client and keeps its numbers in the traffic book: bytes, functions,
// exceptions, requests that wait. Decides which exceptions a silent listener does not send, and
// which requests get no answer. On the server's thread.
class ClientReplies {
 public:
  /// Listener, wire and counters outlive it until Close.
  ClientReplies(const config::Listener& listener, ClientWire& wire, LiveCounters& counters,
                std::shared_ptr<TrafficBook> book, const std::string& peer,
                config::Priority priority, WallTime since);

  /// The client, as its requests carry it.
  const bus::Writer& client() const { return client_; }

  void OnRequest(View frame, Instant now);
  void Answer(const ModbusRequest& request, Responder& responder, Instant now);
  void Answer(View frame, Instant now);
  void AnswerNothing(Instant now) { wire_.AnswerNothing(now); }
  void Refuse(View frame, ExceptionCode exception, Instant now);
  /// A slave has answered an exception.
  void CountException();
  bool IsAwaited(View request) const;

  /// One more request waits: the client is swept at this time.
  void Await(Instant limit);
  /// So many wait no more.
  void Settle(std::size_t count = 1);

  /// The client sends Modbus in another framing.
  void HeardOther(Framing heard, WallTime at);
  /// The client has left: it is in the book no more, and the wire is not called again.
  void Close() { book_->Leave(*record_); }

 private:
  std::size_t BytesOnWire(std::size_t frame) const;

  const config::Listener& listener_;
  ClientWire& wire_;
  LiveCounters& counters_;
  const std::shared_ptr<TrafficBook> book_;
  const std::shared_ptr<ClientRecord> record_;
  const bus::Writer client_;
};

// Requests of one client that are not answered yet, by their numbers: writes to devices, or routed
// requests. Pure.
struct PendingRequest {
  /// At its deadline the line answers what it has not sent, and a write that is confirmed. What is
  /// on the wire then is answered by the server this much later; the record of a write gets the
  /// end that comes.
  static constexpr Duration kGrace = 20ms;

  std::uint64_t number = 0;
  Instant deadline;
  /// The beginning of the request: to the function code; of a write all that its good answer
  /// repeats of it.
  Bytes frame;
  std::size_t route = 0;   ///< its number, of a routed request
  bool abandoned = false;  ///< it goes on, but is not answered

  /// When the server answers it itself.
  Instant Limit() const { return deadline + kGrace; }
};

class PendingRequests {
 public:
  /// Requests of one client that may wait for lines and servers; more are answered "busy".
  static constexpr std::size_t kMost = 32;

  /// No number comes twice.
  std::uint64_t NextNumber() { return next_number_++; }
  void Add(PendingRequest request) { requests_.push_back(std::move(request)); }
  /// Empty: it was answered before.
  std::optional<PendingRequest> Take(std::uint64_t number);
  std::vector<PendingRequest> TakeAll() { return std::exchange(requests_, {}); }
  void AbandonAll();

  std::size_t size() const { return requests_.size(); }
  /// When the first is to be answered by the server; empty: none waits.
  std::optional<Instant> Deadline() const;
  /// The numbers of those whose limit has passed.
  std::vector<std::uint64_t> Overdue(Instant now) const;

 private:
  std::vector<PendingRequest> requests_;  ///< in the order in which they came
  std::uint64_t next_number_ = 0;
};

// Requests of one client that are answered here: reads at once, writes when they have ended or
// their deadline has passed. On the server's thread.
class LocalRequests : public std::enable_shared_from_this<LocalRequests> {
 public:
  /// Listener and units outlive it until Close. `write_deadline`: see ModbusLimits.
  LocalRequests(const config::Listener& listener, OwnUnits& units, std::shared_ptr<Inbox> inbox,
                std::shared_ptr<ClientReplies> replies, Duration write_deadline);

  /// Without room, a write is answered "busy".
  void Handle(View frame, bool has_room, const Now& now);
  /// Unit, function, counts and lengths.
  ExceptionCode Check(View frame) const;
  /// It is not permitted: a write is recorded as denied. The caller answers.
  void Deny(View frame, const std::string& reason, const Now& now);

  void Sweep(const Now& now);
  std::optional<Instant> Deadline() const { return pending_.Deadline(); }
  /// Writes that are not on the wire are not sent. None is answered.
  void Abandon();
  /// The client has left.
  void Close();
  std::size_t outstanding() const { return pending_.size(); }

 private:
  ExceptionCode StartWrite(const ModbusRequest& request, Instant now);
  void AnswerWrite(std::uint64_t number, const WriteResult& result, Instant now);

  const config::Listener& listener_;
  OwnUnits& units_;
  const std::shared_ptr<Inbox> inbox_;
  const std::shared_ptr<ClientReplies> replies_;
  const Duration write_deadline_;
  PendingRequests pending_;
  std::shared_ptr<std::atomic<bool>> abandoned_;  ///< of the writes since Abandon; null: none
};

// Requests of one client that go to slaves as they are, and broadcasts. On the server's thread.
class RoutedRequests : public std::enable_shared_from_this<RoutedRequests> {
 public:
  /// Listener and router outlive it until Abandon was called for the last time. `priority`: of
  /// functions for which the listener has none.
  RoutedRequests(const config::Listener& listener, Router& router, std::shared_ptr<Inbox> inbox,
                 std::shared_ptr<ClientReplies> replies, config::Priority priority);

  /// `route`: its number. Without room it is answered "busy".
  void Forward(View frame, std::size_t route, std::uint8_t slave, bool has_room, const Now& now);
  /// To all slaves of a line; the caller answers nothing.
  void Broadcast(View frame, std::size_t route, const RouteTargets::Line& line, bool has_room,
                 const Now& now);
  /// It is not permitted: that is counted and recorded. The caller answers.
  void Deny(View frame, std::size_t route, const std::string& reason, const Now& now);

  void Sweep(const Now& now);
  std::optional<Instant> Deadline() const { return pending_.Deadline(); }
  /// Requests that are not on the wire are not sent. None is answered.
  void Abandon();
  std::size_t outstanding() const { return pending_.size(); }
  /// Broadcasts under way.
  std::size_t broadcasts() const { return broadcasts_; }

 private:
  void Finish(std::uint64_t number, bus::RoutedReply reply, const Now& now);
  RoutedAsk AskOf(View frame, std::size_t route, bus::RouteTarget* target, bool has_room) const;
  bus::RoutedRequest RequestOf(View frame, Duration deadline, const Now& now) const;
  config::Priority PriorityOf(std::uint8_t function) const;

  const config::Listener& listener_;
  Router& router_;
  const std::shared_ptr<Inbox> inbox_;
  const std::shared_ptr<ClientReplies> replies_;
  const config::Priority priority_;
  PendingRequests pending_;
  std::size_t broadcasts_ = 0;
};

// What the clients of a listener may ask for: its `permit`. Whether a point can be written at all
// is gateway/bus/writes/write_gate.h's affair.

/// Whether clients with this permission may ask for the function code.
bool Permits(config::Permit permit, std::uint8_t function);

class ClientRequests {
 public:
  /// Listener, `shared` and wire outlive it until Close.
  ClientRequests(const config::Listener& listener, ServerShared& shared, ClientWire& wire,
                 const std::string& peer, config::Priority priority, const Now& now);

  /// One whole frame, MBAP header included: leads to exactly one call of the wire, now or later,
  /// unless it is given up before.
  void Handle(View frame, const Now& now);
  /// Whether anything answers for this unit.
  bool Serves(std::uint8_t unit) const { return router_.WayOf(unit).kind != Way::Kind::none; }
  /// Answers requests whose deadline has passed without an answer. An answer may close the client,
  /// but must not destroy this object.
  void Sweep(const Now& now);
  /// The client waits for none of its requests any more. Requests that are not on the wire are not
  /// sent: routed ones by RouteTarget::Abandon, writes by WriteCommand::abandoned. None is
  /// answered.
  void Abandon();
  /// The client sends Modbus in another framing.
  void HeardOther(Framing heard, WallTime at) { replies_->HeardOther(heard, at); }
  /// The client has left: Abandon, and what is kept of it is forgotten (selections and its place
  /// among the events by OwnUnits::Forget, its entry in the traffic book). The wire is not
  /// called again.
  void Close();

  std::size_t outstanding() const { return local_->outstanding() + routed_->outstanding(); }
  /// When Sweep has something to answer; empty: nothing waits.
  std::optional<Instant> Deadline() const;

 private:
  void Deny(View frame, const Way& way, const Now& now);
  void HandleRouted(View frame, std::size_t index, const Now& now);
  void HandleBroadcast(View frame, std::size_t index, std::span<const RouteTargets::Line> lines,
                       const Now& now);
  bool HasRoom() const { return outstanding() + routed_->broadcasts() < PendingRequests::kMost; }

  const config::Listener& listener_;
  Router& router_;
  const std::shared_ptr<ClientReplies> replies_;
  const std::shared_ptr<LocalRequests> local_;
  const std::shared_ptr<RoutedRequests> routed_;
  bool closed_ = false;
};

}  // namespace baudgate::modbus
