// `ClientRequests` handles the requests of one client, over TCP or a serial line: it decides
// whether a request is permitted, and whether the gateway or a route answers it. Whole frames in
// Modbus TCP form come from gateway/outputs/modbus/server/client_session.cpp (sockets) and
// gateway/outputs/modbus/serial/serial_listener.cpp (a serial master); replies return to them.
// Everything runs on the server's thread; the time is an argument. `ClientWire` and `ClientReplies`
// send replies, `LocalRequests` and `RoutedRequests` handle requests, `PendingRequests` lists
// unanswered requests. `ServerShared` contains what all clients
// share; other threads use only its traffic book and the snapshot of its counters. `ModbusLinks`
// contains the parts of the gateway that the server uses.
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
#include "gateway/outputs/modbus/service/permits.h"
#include "gateway/outputs/modbus/service/router.h"
#include "gateway/outputs/modbus/service/traffic_book.h"
#include "gateway/outputs/modbus/wire/request.h"
#include "gateway/records/audit/security_journal.h"

namespace baudgate::modbus {

// `Inbox` passes results of writes and routed requests from a line's thread to the Modbus server's
// thread. It can outlive the server, because lines answer late; tasks that are posted after Close
// are dropped.
class Inbox {
 public:
  using Clocks = std::function<Now()>;

  /// From now on, posted tasks run on `io`. Each task gets the result of `clocks()` at the time
  /// when it runs.
  void Open(asio::io_context& io, Clocks clocks) {
    const MutexLock lock(mutex_);
    io_ = &io;
    clocks_ = std::move(clocks);
  }
  void Close() {
    const MutexLock lock(mutex_);
    io_ = nullptr;
  }
  /// Runs `task`, which takes a `const Now&`, on the server's thread. Any thread may call Post.
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

/// Limits that cannot be configured; tests shorten them.
struct ModbusLimits {
  /// A write that is not confirmed within this time is answered with exception 0x0B.
  Duration write_deadline = bus::kWaitForDevice;
  Duration stall = 10s;  ///< a client that does not read its replies for this time is disconnected
  double client_share = 1;  ///< share of each listener's max_clients that is allowed to connect
};

/// The parts of the gateway, besides the point store, that the server needs for routes, serial
/// framings, events and alarms. All must outlive the server.
struct ModbusLinks {
  /// The lines, by index in config.lines; empty: no route leads to a line.
  std::vector<bus::RouteTarget*> lines;
  Frames frames{};
  /// Records routed writes and acknowledgements; null: nothing is recorded.
  audit::WriteLog* writes = nullptr;
  std::shared_ptr<const events::EventFeed> events{};
  events::EventSource* alarms = nullptr;  ///< acknowledges alarms; null: there are no alarms
  OnRoutedReport routed{};  ///< called for the result of each routed request; can be null
  /// Records clients with certificates, and hosts that connect for the first time; can be null.
  audit::SecurityJournal* journal = nullptr;
};

// `ServerShared` contains the parts that all clients of a Modbus server share: units, routes, the
// traffic book, the inbox of the server's thread, limits and counters.
class ServerShared {
 public:
  ServerShared(const config::Config& config, const bus::PointStore& store, bus::CommandSink& sink,
               std::function<GatewayFigures()> info, ModbusLimits limits,
               const ModbusLinks& links = {});

  /// Applies the configuration of a reload. Clients and their pending requests stay. `routes`: the
  /// old index of each route (Origins).
  void Apply(const config::Config& config, std::span<bus::RouteTarget* const> lines,
             const Origins& routes);
  /// Sets the share of each listener's max_clients that is allowed to be connected. It applies to
  /// new clients; clients that are connected stay.
  void SetClientShare(double share) { limits_.client_share = share; }

  /// Accepts answers of lines and servers from now on, and creates the remote servers of the
  /// routes. `clocks`: see Inbox.
  void Open(asio::io_context& io, Inbox::Clocks clocks);
  /// Drops all later answers of lines and servers.
  void CloseInbox() { inbox_->Close(); }
  void CloseRoutes() { router_.Close(); }

  Status Ready() { return units_.responder().ready(); }
  OwnUnits& units() { return units_; }
  Router& router() { return router_; }
  const Frames& frames() const { return frames_; }

  /// Adds a row to the security journal, if there is one.
  void Note(audit::SecurityEvent event, WallTime now) {
    if (journal_ != nullptr) journal_->Note(std::move(event), now);
  }
  void NoteHost(const std::string& peer, const std::string& place, WallTime now) {
    if (journal_ != nullptr) journal_->NoteHost(peer, place, now);
  }

  LiveCounters& counters() { return counters_; }
  const LiveCounters& counters() const { return counters_; }
  const ModbusLimits& limits() const { return limits_; }
  const std::shared_ptr<Inbox>& inbox() const { return inbox_; }
  /// The traffic book. It is shared, because requests that lines still hold can outlive the server.
  const std::shared_ptr<TrafficBook>& book() const { return book_; }

 private:
  ModbusLimits limits_;
  const std::shared_ptr<TrafficBook> book_ = std::make_shared<TrafficBook>();
  LiveCounters counters_;
  OwnUnits units_;
  Router router_;
  Frames frames_;
  audit::SecurityJournal* const journal_;
  const std::shared_ptr<Inbox> inbox_ = std::make_shared<Inbox>();
};

// `ClientWire` sends replies to one client. A session implements it, so that requests can be
// answered at once or later. It is used on the server's thread only.
class ClientWire {
 public:
  /// Answers a read from the store. The responder's buffers contain the values only during this
  /// call.
  virtual void Answer(const ModbusRequest& request, Responder& responder, Instant now) = 0;
  /// Sends a whole frame in Modbus TCP form, e.g. a confirmed write, an exception or a routed
  /// reply.
  virtual void Answer(View frame, Instant now) = 0;
  /// Must be called when a request gets no reply (a broadcast, or an exception that a silent
  /// listener does not send), so that the session can go on with the next request.
  virtual void AnswerNothing(Instant now) = 0;
  /// Requests that Sweep is called at the time `at` or earlier. A later call does not cancel an
  /// earlier one.
  virtual void SweepAt(Instant at) = 0;

 protected:
  ~ClientWire() = default;
};

// `ClientReplies` sends the replies to one client and counts bytes, functions, exceptions and
// pending requests in the traffic book. It decides which exceptions a silent listener does not
// send, and which requests get no reply. It is used on the server's thread only.
class ClientReplies {
 public:
  /// `listener`, `wire` and `counters` must remain valid until Close.
  ClientReplies(const config::Listener& listener, ClientWire& wire, LiveCounters& counters,
                std::shared_ptr<TrafficBook> book, const std::string& peer,
                config::Priority priority, WallTime since);

  const bus::Writer& client() const { return client_; }

  void OnRequest(View frame, Instant now);
  void Answer(const ModbusRequest& request, Responder& responder, Instant now);
  void Answer(View frame, Instant now);
  void AnswerNothing(Instant now) { wire_.AnswerNothing(now); }
  void Refuse(View frame, ExceptionCode exception, Instant now);
  void CountException();
  /// False for a broadcast on a serial framing: its sender waits for no reply, and would take a
  /// reply as the answer to its next request.
  bool IsAwaited(View request) const;

  /// Counts a pending request, and requests a Sweep of this client at the time `limit`.
  void Await(Instant limit);
  void Settle(std::size_t count = 1);

  /// Counts that the client uses the framing `heard` instead of the configured one.
  void HeardOther(Framing heard, WallTime at);
  /// Must be called when the client has left: removes the client from the traffic book. The wire is
  /// not called after Close.
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

struct PendingRequest {
  /// At the deadline, the line answers a request that it has not sent, and a write that waits for
  /// its confirmation. The server waits this much longer for such an answer, and then answers
  /// requests that are still on the wire. The record of a write gets the line's result in any case.
  static constexpr Duration kGrace = 20ms;

  std::uint64_t number = 0;
  Instant deadline;
  /// The first bytes of the request: up to the function code, and for a write, all bytes that a
  /// good reply repeats.
  Bytes frame;
  /// The route's number (RouteList); only for routed requests.
  std::size_t route = 0;
  bool abandoned = false;  ///< the client no longer waits, so no reply is sent

  /// The time at which the server answers the request if the line has not answered it.
  Instant Limit() const { return deadline + kGrace; }
};

class PendingRequests {
 public:
  /// The most requests of one client that can wait for lines and servers. The client's next request
  /// is answered "busy".
  static constexpr std::size_t kMost = 32;

  std::uint64_t NextNumber() { return next_number_++; }
  void Add(PendingRequest request) { requests_.push_back(std::move(request)); }
  std::optional<PendingRequest> Take(std::uint64_t number);
  std::vector<PendingRequest> TakeAll() { return std::exchange(requests_, {}); }
  void AbandonAll();

  std::size_t size() const { return requests_.size(); }
  std::optional<Instant> Deadline() const;
  std::vector<std::uint64_t> Overdue(Instant now) const;

 private:
  std::vector<PendingRequest> requests_;
  std::uint64_t next_number_ = 0;
};

// `LocalRequests` handles the requests of one client that the gateway answers from its own units:
// reads at once, writes when they have ended or their deadline has passed. It is used on the
// server's thread only.
class LocalRequests : public std::enable_shared_from_this<LocalRequests> {
 public:
  /// `listener` and `units` must remain valid until Close. `write_deadline`: see ModbusLimits.
  LocalRequests(const config::Listener& listener, OwnUnits& units, std::shared_ptr<Inbox> inbox,
                std::shared_ptr<ClientReplies> replies, Duration write_deadline);

  /// Handles a whole frame. If `has_room` is false, a write is answered "busy".
  void Handle(View frame, bool has_room, const Now& now);
  /// Returns the exception for a wrong unit, function, count or length, else kNoException.
  ExceptionCode Check(View frame) const;
  /// Records a write that is not permitted as denied. The caller sends the reply.
  void Deny(View frame, const std::string& reason, const Now& now);

  void Sweep(const Now& now);
  std::optional<Instant> Deadline() const { return pending_.Deadline(); }
  /// Drops all pending writes without a reply. Writes that were not sent to the device yet are not
  /// sent.
  void Abandon();
  /// Must be called when the client has left: removes its pending writes, its selections and its
  /// first event to show.
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
  /// A flag that all writes since the last Abandon share; Abandon sets it. Null: there were no
  /// writes.
  std::shared_ptr<std::atomic<bool>> abandoned_;
};

// `RoutedRequests` handles the requests of one client that are passed to slaves unchanged, and
// broadcasts. It is used on the server's thread only.
class RoutedRequests : public std::enable_shared_from_this<RoutedRequests> {
 public:
  /// `listener` and `router` must remain valid until the last call of Abandon. `priority` applies
  /// to functions for which the listener configures no priority.
  RoutedRequests(const config::Listener& listener, Router& router, std::shared_ptr<Inbox> inbox,
                 std::shared_ptr<ClientReplies> replies, config::Priority priority);

  /// `route`: the number of the route. If `has_room` is false, the request is answered "busy".
  void Forward(View frame, std::size_t route, std::uint8_t slave, bool has_room, const Now& now);
  /// Sends a request to all slaves of a line; the caller sends no reply.
  void Broadcast(View frame, std::size_t route, const RouteTargets::Line& line, bool has_room,
                 const Now& now);
  void Deny(View frame, std::size_t route, const std::string& reason, const Now& now);

  void Sweep(const Now& now);
  std::optional<Instant> Deadline() const { return pending_.Deadline(); }
  /// Drops all pending requests without a reply. Requests that were not sent to the slave yet are
  /// not sent.
  void Abandon();
  std::size_t outstanding() const { return pending_.size(); }
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

class ClientRequests {
 public:
  /// `listener`, `shared`, `wire` and `rights` must remain valid until Close. `rights`: those of
  /// the client's role at a listener with TLS; null: the client has no role, so nothing is
  /// permitted. Other listeners do not use `rights`.
  ClientRequests(const config::Listener& listener, ServerShared& shared, ClientWire& wire,
                 const std::string& peer, config::Priority priority,
                 const config::RoleRights* rights, const Now& now);

  /// Handles one whole frame, including the MBAP header. `wire` is called exactly once for it, now
  /// or later, unless the request is abandoned before.
  void Handle(View frame, const Now& now);
  bool Serves(std::uint8_t unit) const { return router_.WayOf(unit).kind != Way::Kind::none; }
  /// Answers requests whose deadline has passed. During the call the wire can close the client, but
  /// must not destroy this object.
  void Sweep(const Now& now);
  /// Must be called when the client no longer waits for any of its requests. Drops the requests
  /// without a reply. Requests that were not sent to a device yet are not sent:
  /// RouteTarget::Abandon removes routed requests, WriteCommand::abandoned stops writes.
  void Abandon();
  void HeardOther(Framing heard, WallTime at) { replies_->HeardOther(heard, at); }
  /// Must be called when the client has left. Calls Abandon, and removes the client's selections,
  /// its first event to show (OwnUnits::Forget) and its entry in the traffic book. The wire is not
  /// called after Close.
  void Close();

  std::uint64_t host() const { return replies_->client().host; }
  std::size_t outstanding() const { return local_->outstanding() + routed_->outstanding(); }
  /// Returns the next time at which Sweep has a request to answer; nothing: no request waits.
  std::optional<Instant> Deadline() const;

 private:
  void Deny(View frame, const Way& way, const std::string& reason, ExceptionCode exception,
            const Now& now);
  bool UsesRoles() const;
  /// True if the client may not send all requests, because of `permit` or its role.
  bool IsLimited() const;
  /// Returns why the client may not send the request; empty: it may.
  std::string WhyDenied(View frame) const;
  void HandleRouted(View frame, std::size_t index, const Now& now);
  void HandleBroadcast(View frame, std::size_t index, std::span<const RouteTargets::Line> lines,
                       const Now& now);
  bool HasRoom() const { return outstanding() + routed_->broadcasts() < PendingRequests::kMost; }

  const config::Listener& listener_;
  const config::RoleRights* const rights_;
  Router& router_;
  const std::shared_ptr<ClientReplies> replies_;
  const std::shared_ptr<LocalRequests> local_;
  const std::shared_ptr<RoutedRequests> routed_;
  bool closed_ = false;
};

}  // namespace baudgate::modbus
