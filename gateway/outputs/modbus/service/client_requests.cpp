// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/service/client_requests.h"

#include <algorithm>
#include <utility>

#include "gateway/base/fair_places.h"
#include "gateway/base/time.h"
#include "gateway/outputs/modbus/service/own_units.h"
#include "protocols/modbus_pdu/modbus_pdu.h"

namespace baudgate::modbus {

ServerShared::ServerShared(const config::Config& config, const bus::PointStore& store,
                           bus::CommandSink& sink, std::function<GatewayFigures()> info,
                           ModbusLimits limits, const ModbusLinks& links)
    : limits_(limits),
      units_(
          config, store, sink,
          [this, info = std::move(info)] {
            return GatewayBlockOf(info ? info() : GatewayFigures{}, counters_.Snapshot());
          },
          links.events, AckRegister(store, links.alarms, links.writes)),
      router_(config, links.lines, links.writes, links.routed, book_),
      frames_(links.frames),
      journal_(links.journal) {}

void ServerShared::Open(asio::io_context& io, Inbox::Clocks clocks) {
  inbox_->Open(io, std::move(clocks));
  router_.Open(io);
}

void ServerShared::Apply(const config::Config& config, std::span<bus::RouteTarget* const> lines,
                         const Origins& routes) {
  units_.Apply(config);
  router_.Apply(config, lines, routes);
}

namespace {

/// True for the exceptions of a gateway: no such unit, no reply from the target, too many requests.
/// A listener with `errors: silent` does not send them.
bool IsGatewayTrouble(ExceptionCode exception) {
  return exception == kNoPath || exception == kNoTarget || exception == kBusy;
}

}  // namespace

ClientReplies::ClientReplies(const config::Listener& listener, ClientWire& wire,
                             LiveCounters& counters, std::shared_ptr<TrafficBook> book,
                             const std::string& peer, config::Priority priority, WallTime since)
    : listener_(listener),
      wire_(wire),
      counters_(counters),
      book_(std::move(book)),
      record_(book_->Enter(peer, listener, priority, since)),
      client_{peer, record_->id, {}, HostNumberOf(peer)} {}

void ClientReplies::OnRequest(View frame, Instant now) {
  LiveCounters::Add(counters_.requests);
  ClientRecord::Add(record_->requests);
  ClientRecord::Add(record_->bytes_in, BytesOnWire(frame.size()));
  record_->last_request.store(now, std::memory_order_relaxed);
}

void ClientReplies::Answer(const ModbusRequest& request, Responder& responder, Instant now) {
  ClientRecord::Add(record_->bytes_out, BytesOnWire(ReplySize(request)));
  record_->functions->Add(request.function);
  wire_.Answer(request, responder, now);
}

void ClientReplies::Answer(View frame, Instant now) {
  ClientRecord::Add(record_->bytes_out, BytesOnWire(frame.size()));
  const std::uint8_t function = FunctionOf(frame);
  const bool refused = (function & kExceptionBit) != 0 && frame.size() > kMbapHeader + 1;
  record_->functions->Add(function & ~kExceptionBit, refused ? frame[kMbapHeader + 1] : 0);
  wire_.Answer(frame, now);
}

void ClientReplies::Refuse(View frame, ExceptionCode exception, Instant now) {
  const bool silent = listener_.errors == config::Listener::Errors::silent;
  const bool kept = silent && IsGatewayTrouble(exception);
  if (kept || !IsAwaited(frame)) return wire_.AnswerNothing(now);
  CountException();
  Answer(ExceptionReply(frame, exception), now);
}

void ClientReplies::CountException() {
  LiveCounters::Add(counters_.exceptions);
  ClientRecord::Add(record_->exceptions);
}

bool ClientReplies::IsAwaited(View request) const {
  const bool to_all =
      listener_.speaks_serial() && UnitOf(request) == 0 && IsPlainWrite(FunctionOf(request));
  return !to_all;
}

void ClientReplies::Await(Instant limit) {
  record_->outstanding.fetch_add(1, std::memory_order_relaxed);
  wire_.SweepAt(limit);
}

void ClientReplies::Settle(std::size_t count) {
  record_->outstanding.fetch_sub(static_cast<std::uint32_t>(count), std::memory_order_relaxed);
}

void ClientReplies::HeardOther(Framing heard, WallTime at) {
  book_->HeardOther(listener_.Address(), client_.name, heard, listener_.framing, at);
}

std::size_t ClientReplies::BytesOnWire(std::size_t frame) const {
  constexpr std::size_t kRtuFrame = 3;
  constexpr std::size_t kAsciiFrame = 3;  // colon, CR and LF around address, PDU and LRC in hex
  const std::size_t pdu = frame - kMbapHeader;
  switch (listener_.framing) {
    case Framing::tcp:
      break;
    case Framing::rtu:
      return pdu + kRtuFrame;
    case Framing::ascii:
      return 2 * (pdu + 2) + kAsciiFrame;
  }
  return frame;
}

std::optional<PendingRequest> PendingRequests::Take(std::uint64_t number) {
  const auto found = std::ranges::find(requests_, number, &PendingRequest::number);
  if (found == requests_.end()) return std::nullopt;
  PendingRequest request = std::move(*found);
  requests_.erase(found);
  return request;
}

void PendingRequests::AbandonAll() {
  for (PendingRequest& request : requests_) request.abandoned = true;
}

std::optional<Instant> PendingRequests::Deadline() const {
  std::optional<Instant> next;
  for (const PendingRequest& request : requests_) next = Soonest({next, request.Limit()});
  return next;
}

std::vector<std::uint64_t> PendingRequests::Overdue(Instant now) const {
  std::vector<std::uint64_t> overdue;
  for (const PendingRequest& request : requests_) {
    if (now >= request.Limit()) overdue.push_back(request.number);
  }
  return overdue;
}

namespace {

constexpr const char* kTooMany =
    "the request was not sent, because this client has 32 unanswered requests already";
static_assert(PendingRequests::kMost == 32);

}  // namespace

LocalRequests::LocalRequests(const config::Listener& listener, OwnUnits& units,
                             std::shared_ptr<Inbox> inbox, std::shared_ptr<ClientReplies> replies,
                             Duration write_deadline)
    : listener_(listener),
      units_(units),
      inbox_(std::move(inbox)),
      replies_(std::move(replies)),
      write_deadline_(write_deadline) {}

void LocalRequests::Handle(View frame, bool has_room, const Now& now) {
  ModbusRequest request;
  ExceptionCode exception = units_.Check(frame, request);
  if (exception != kNoException) return replies_->Refuse(frame, exception, now.instant);
  const bool write = IsPlainWrite(request.function);
  const bus::Writer& client = replies_->client();
  if (write && !has_room) {
    units_.Deny(frame, client, {.end = WriteEnd::busy, .reason = kTooMany}, now);
    return replies_->Refuse(frame, kBusy, now.instant);
  }
  exception = write ? StartWrite(request, now.instant)
                    : units_.Read(request, listener_.holes, now.instant, client.number);
  if (exception != kNoException) return replies_->Refuse(frame, exception, now.instant);
  if (!write) replies_->Answer(request, units_.responder(), now.instant);
}

ExceptionCode LocalRequests::Check(View frame) const {
  ModbusRequest request;
  return units_.Check(frame, request);
}

void LocalRequests::Deny(View frame, const std::string& reason, const Now& now) {
  units_.Deny(frame, replies_->client(), {.end = WriteEnd::denied, .reason = reason}, now);
}

ExceptionCode LocalRequests::StartWrite(const ModbusRequest& request, Instant now) {
  const std::uint64_t number = pending_.NextNumber();
  const Instant deadline = now + write_deadline_;
  auto done = [inbox = inbox_, requests = weak_from_this(), number](const WriteResult& result) {
    inbox->Post([requests, number, result](const Now& now) {
      if (const auto self = requests.lock()) self->AnswerWrite(number, result, now.instant);
    });
  };
  if (!abandoned_) abandoned_ = std::make_shared<std::atomic<bool>>(false);
  const auto exception =
      units_.Write(request, {replies_->client(), deadline, abandoned_}, now, std::move(done));
  if (exception != kNoException) return exception;
  PendingRequest pending;
  pending.number = number;
  pending.deadline = deadline;
  pending.frame = CopyOf(request.frame.first(kMbapHeader + kWriteReply));
  replies_->Await(pending.Limit());
  pending_.Add(std::move(pending));
  return kNoException;
}

void LocalRequests::AnswerWrite(std::uint64_t number, const WriteResult& result, Instant now) {
  const auto pending = pending_.Take(number);
  if (!pending) return;
  replies_->Settle();
  if (pending->abandoned) return;
  const View asked = pending->frame;
  const ExceptionCode exception = ExceptionOf(result);
  if (exception != kNoException) return replies_->Refuse(asked, exception, now);
  replies_->Answer(AduOf(TransactionOf(asked), UnitOf(asked), PduOf(asked)), now);
}

void LocalRequests::Sweep(const Now& now) {
  for (const std::uint64_t number : pending_.Overdue(now.instant)) {
    AnswerWrite(number, {.end = WriteEnd::unknown}, now.instant);
  }
}

void LocalRequests::Abandon() {
  if (abandoned_) std::exchange(abandoned_, nullptr)->store(true);
  pending_.AbandonAll();
}

void LocalRequests::Close() {
  pending_.TakeAll();
  units_.Forget(replies_->client());
}

namespace {

bool IsReply(const bus::RoutedReply& reply) {
  const bool answered = reply.outcome == Outcome::ok || reply.outcome == Outcome::refused;
  return answered && !reply.pdu.empty() && reply.pdu.size() <= kMaxPdu;
}

RouteOutcome RouteOutcomeOf(const bus::RoutedReply& reply, bool late) {
  if (IsReply(reply))
    return reply.outcome == Outcome::ok ? RouteOutcome::ok : RouteOutcome::refused;
  return late && !reply.sent ? RouteOutcome::expired : RouteOutcome::no_reply;
}

RouteOutcome BroadcastOutcomeOf(const bus::RoutedReply& reply, bool late) {
  const bool sent = reply.sent || reply.outcome == Outcome::ok;
  return sent ? RouteOutcome::broadcast : RouteOutcomeOf(reply, late);
}

}  // namespace

RoutedRequests::RoutedRequests(const config::Listener& listener, Router& router,
                               std::shared_ptr<Inbox> inbox, std::shared_ptr<ClientReplies> replies,
                               config::Priority priority)
    : listener_(listener),
      router_(router),
      inbox_(std::move(inbox)),
      replies_(std::move(replies)),
      priority_(priority) {}

void RoutedRequests::Forward(View frame, std::size_t route, std::uint8_t slave, bool has_room,
                             const Now& now) {
  bus::RouteTarget* const target = router_.TargetOf(route);
  if (target == nullptr) return replies_->Refuse(frame, kNoPath, now.instant);
  const std::uint64_t number = pending_.NextNumber();
  bus::RoutedRequest request = RequestOf(frame, router_.route(route).deadline, now);
  request.client = replies_->client().number;
  request.slave = slave;
  request.done = [inbox = inbox_, requests = weak_from_this(), number](bus::RoutedReply reply) {
    inbox->Post([requests, number, reply = std::move(reply)](const Now& now) mutable {
      if (const auto self = requests.lock()) self->Finish(number, std::move(reply), now);
    });
  };
  PendingRequest pending;
  pending.number = number;
  pending.deadline = request.deadline;
  pending.frame = CopyOf(frame.first(kMbapHeader + 1));
  pending.route = route;
  if (!router_.Submit(AskOf(frame, route, target, has_room), std::move(request), now)) {
    return replies_->Refuse(frame, kBusy, now.instant);
  }
  replies_->Await(pending.Limit());
  pending_.Add(std::move(pending));
}

void RoutedRequests::Finish(std::uint64_t number, bus::RoutedReply reply, const Now& now) {
  const auto pending = pending_.Take(number);
  if (!pending) return;
  replies_->Settle();
  const View asked = pending->frame;
  const bool late = now.instant >= pending->deadline;
  if (late && IsReply(reply)) {
    reply.outcome = Outcome::no_reply;
    reply.pdu.clear();
    reply.reason = "the reply came after the deadline of the request";
  }
  router_.OnEnd(pending->route, UnitOf(asked), RouteOutcomeOf(reply, late), reply, now);
  if (!IsReply(reply)) return replies_->Refuse(asked, kNoTarget, now.instant);
  if (reply.outcome == Outcome::refused) replies_->CountException();
  if (!replies_->IsAwaited(asked)) return replies_->AnswerNothing(now.instant);
  replies_->Answer(AduOf(TransactionOf(asked), UnitOf(asked), reply.pdu), now.instant);
}

/// Sends a broadcast. The request contains no client number, so that it is sent even if the client
/// disconnects at once: a client does not wait after a broadcast.
void RoutedRequests::Broadcast(View frame, std::size_t route, const RouteTargets::Line& line,
                               bool has_room, const Now& now) {
  bus::RoutedRequest request = RequestOf(frame, line.deadline, now);
  request.broadcast = true;
  request.done = [inbox = inbox_, book = router_.book(), requests = weak_from_this(), route,
                  unit = UnitOf(frame), deadline = request.deadline](bus::RoutedReply reply) {
    inbox->Post([book, requests, route, unit, deadline, reply = std::move(reply)](const Now& now) {
      book->Ended(route, unit, BroadcastOutcomeOf(reply, now.instant >= deadline), reply, now.wall);
      if (const auto self = requests.lock()) --self->broadcasts_;
    });
  };
  if (router_.Submit(AskOf(frame, route, line.target, has_room), std::move(request), now)) {
    ++broadcasts_;
  }
}

void RoutedRequests::Deny(View frame, std::size_t route, const std::string& reason,
                          const Now& now) {
  router_.Deny(AskOf(frame, route, router_.TargetOf(route), true), PduOf(frame), reason, now);
}

void RoutedRequests::Sweep(const Now& now) {
  bus::RoutedReply nothing;
  nothing.outcome = Outcome::no_reply;
  nothing.reason =
      "the deadline of the request passed without a reply, and perhaps the request was carried out";
  nothing.sent = true;  // whether it was sent is unknown, so the worse case is assumed
  for (const std::uint64_t number : pending_.Overdue(now.instant)) Finish(number, nothing, now);
}

/// The router is called even if no request is pending, because a line or server can still have a
/// request that Sweep has answered already.
void RoutedRequests::Abandon() {
  router_.Abandon(replies_->client().number);
  const auto abandoned = pending_.TakeAll();
  for (const PendingRequest& pending : abandoned) {
    router_.OnAbandoned(pending.route, UnitOf(pending.frame));
  }
  replies_->Settle(abandoned.size());
}

RoutedAsk RoutedRequests::AskOf(View frame, std::size_t route, bus::RouteTarget* target,
                                bool has_room) const {
  return {.route = route,
          .unit = UnitOf(frame),
          .peer = replies_->client().name,
          .target = target,
          .has_room = has_room};
}

bus::RoutedRequest RoutedRequests::RequestOf(View frame, Duration deadline, const Now& now) const {
  bus::RoutedRequest request;
  request.host = replies_->client().host;
  request.pdu = CopyOf(PduOf(frame));
  request.priority = PriorityOf(FunctionOf(frame));
  request.arrived = now.instant;
  request.deadline = now.instant + deadline;
  return request;
}

config::Priority RoutedRequests::PriorityOf(std::uint8_t function) const {
  for (const config::FunctionPriority& rule : listener_.functions) {
    if (std::ranges::find(rule.codes, function) != rule.codes.end()) return rule.priority;
  }
  return priority_;
}

namespace {

constexpr const char* kNotPermitted =
    "the listener does not permit this request; see its 'permit' and 'write' in modbus.listen";

}  // namespace

ClientRequests::ClientRequests(const config::Listener& listener, ServerShared& shared,
                               ClientWire& wire, const std::string& peer, config::Priority priority,
                               const config::RoleRights* rights, const Now& now)
    : listener_(listener),
      rights_(rights),
      router_(shared.router()),
      replies_(std::make_shared<ClientReplies>(listener, wire, shared.counters(), shared.book(),
                                               peer, priority, now.wall)),
      local_(std::make_shared<LocalRequests>(listener, shared.units(), shared.inbox(), replies_,
                                             shared.limits().write_deadline)),
      routed_(std::make_shared<RoutedRequests>(listener, router_, shared.inbox(), replies_,
                                               priority)) {}

void ClientRequests::Handle(View frame, const Now& now) {
  replies_->OnRequest(frame, now.instant);
  const Way way = router_.WayOf(UnitOf(frame));
  const bool is_stranger = UsesRoles() && rights_ == nullptr;  // must not learn which units exist
  if (way.kind == Way::Kind::none) {
    return replies_->Refuse(frame, is_stranger ? kIllegalFunction : kNoPath, now.instant);
  }
  if (const std::string why = WhyDenied(frame); !why.empty()) {
    return Deny(frame, way, why, kIllegalFunction, now);
  }
  if (way.kind == Way::Kind::route && IsLimited() && !HasExactForm(frame)) {
    return Deny(frame, way,
                "the lengths in the request do not fit each other, and this client may not send "
                "all requests",
                kIllegalValue, now);
  }
  if (way.kind == Way::Kind::route) return HandleRouted(frame, way.route, now);
  if (UnitOf(frame) == 0 && IsPlainWrite(FunctionOf(frame))) {
    return HandleBroadcast(frame, TrafficBook::kBroadcasts, router_.lines(), now);
  }
  local_->Handle(frame, HasRoom(), now);
}

std::string ClientRequests::WhyDenied(View frame) const {
  if (!Permits(listener_.permit, FunctionOf(frame))) return kNotPermitted;
  if (!UsesRoles()) return {};
  if (rights_ == nullptr) {
    return "the client's certificate has no role that may send requests; see 'roles' of the "
           "listener in modbus.listen";
  }
  if (Permits(*rights_, frame)) return {};
  return "the role '" + rights_->role +
         "' of the client may not send this request; see 'roles' of the listener in modbus.listen";
}

bool ClientRequests::UsesRoles() const {
  return listener_.protocol == config::Listener::Protocol::tls;
}

bool ClientRequests::IsLimited() const {
  if (listener_.permit != config::Permit::all) return true;
  if (!UsesRoles()) return false;
  return rights_ == nullptr || !rights_->rules.empty() || rights_->permit != config::Permit::all;
}

void ClientRequests::Deny(View frame, const Way& way, const std::string& reason,
                          ExceptionCode exception, const Now& now) {
  const bool gateway = way.kind == Way::Kind::gateway && UnitOf(frame) != 0;
  if (way.kind == Way::Kind::route) routed_->Deny(frame, way.route, reason, now);
  if (way.kind == Way::Kind::device || gateway) local_->Deny(frame, reason, now);
  replies_->Refuse(frame, exception, now.instant);
}

void ClientRequests::HandleRouted(View frame, std::size_t index, const Now& now) {
  const config::Route& route = router_.route(index);
  if (!IsFunction(FunctionOf(frame))) {
    return replies_->Refuse(frame, kIllegalFunction, now.instant);
  }
  const std::uint8_t slave = route.SlaveOf(UnitOf(frame));
  if (slave == 0 && !route.remap && IsPlainWrite(FunctionOf(frame))) {
    const RouteTargets::Line line{router_.TargetOf(index), route.deadline};
    return HandleBroadcast(frame, index, std::span(&line, 1), now);
  }
  // No slave of a line has the address 0. At a remote server, 0 is a unit like any other.
  if (slave == 0 && !route.line.empty()) return local_->Handle(frame, HasRoom(), now);
  routed_->Forward(frame, index, slave, HasRoom(), now);
}

void ClientRequests::HandleBroadcast(View frame, std::size_t index,
                                     std::span<const RouteTargets::Line> lines, const Now& now) {
  if (listener_.broadcast == config::Listener::Broadcast::ignore) {
    const ExceptionCode malformed = local_->Check(frame);
    const auto exception = malformed != kNoException ? malformed : kIllegalAddress;
    return replies_->Refuse(frame, exception, now.instant);
  }
  for (const RouteTargets::Line& line : lines) {
    if (line.target != nullptr) routed_->Broadcast(frame, index, line, HasRoom(), now);
  }
  replies_->AnswerNothing(now.instant);
}

void ClientRequests::Sweep(const Now& now) {
  local_->Sweep(now);
  routed_->Sweep(now);
}

std::optional<Instant> ClientRequests::Deadline() const {
  return Soonest({local_->Deadline(), routed_->Deadline()});
}

void ClientRequests::Abandon() {
  routed_->Abandon();
  local_->Abandon();
}

void ClientRequests::Close() {
  if (closed_) return;
  closed_ = true;
  Abandon();
  local_->Close();
  replies_->Close();
}

}  // namespace baudgate::modbus
