// `Upstream::Link` queues, sends, expires and answers the requests to a remote server, and makes
// and renews the connection.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/upstream/upstream.h"

#include <algorithm>
#include <asio/dispatch.hpp>
#include <asio/post.hpp>
#include <optional>
#include <utility>

#include "gateway/base/log.h"
#include "gateway/base/text.h"
#include "gateway/base/time.h"
#include "gateway/outputs/modbus/upstream/upstream_link.h"
#include "gateway/outputs/modbus/wire/request.h"

namespace baudgate::modbus {

namespace {

constexpr Duration kConnectTimeout = 5s;  // for the name look-up and the connecting together

}  // namespace

// ---------------------------------------------------------------- called on any thread

bool Upstream::Link::Submit(bus::RoutedRequest request) {
  const UpstreamQueue::Entry entry = queue_.Submit(std::move(request));
  if (entry == UpstreamQueue::Entry::first) {
    asio::post(io_, [self = shared_from_this()] { self->TakeIncoming(); });
  }
  return entry != UpstreamQueue::Entry::refused;
}

void Upstream::Link::Abandon(std::uint64_t client) {
  // dispatch() and not post(): on the server's thread Drop runs at once, before the client's next
  // request is handled.
  asio::dispatch(io_, [self = shared_from_this(), client] { self->Drop(client); });
}

// ---------------------------------------------------------------- called on the server's thread

void Upstream::Link::Start() {
  resting_ = false;
  queue_.Open();
}

void Upstream::Link::Rest() {
  resting_ = true;
  TakeIncoming();
}

void Upstream::Link::CloseAtRest() {
  if (!resting_ || !connection_ || !queue_.empty() || !on_wire_.empty()) return;
  std::exchange(connection_, nullptr)->Close();
  log::Info("modbus: {}: disconnected, because no route uses the server any more", name_);
}

void Upstream::Link::Stop() {
  if (!queue_.Close()) return;
  timer_.cancel();
  if (connection_) std::exchange(connection_, nullptr)->Close();
  const std::string why = "the gateway is stopping";
  for (const Sent& sent : on_wire_.TakeAll()) sent.Answer(Outcome::no_reply, {}, why);
  AnswerUnsent(queue_.TakeAll(), Outcome::line_down, why);
}

void Upstream::Link::TakeIncoming() {
  if (queue_.Gather()) Work();
}

void Upstream::Link::Drop(std::uint64_t client) {
  if (!queue_.Gather()) return;
  queue_.Abandon(client);
  on_wire_.Abandon(client);
}

/// Does all work that is due. Must be called after any change of the queue or the connection, and
/// when the timer expires.
void Upstream::Link::Work() {
  const Instant now = clock_();
  ExpireWaiting(now);
  ExpireSent(now);
  if (connection_ && !connection_->connected() && now >= connect_by_) {
    Break("does not answer; is it on and reachable?", now);
  }
  RefusePaused(now);
  if (connection_ && connection_->connected()) Pump(now);
  if (!connection_ && !queue_.empty()) {
    if (reconnect_.MayConnect(now)) {
      Connect(now);
    } else {
      AnswerUnsent(queue_.TakeAll(), Outcome::line_down, reconnect_.trouble());
    }
  }
  CloseAtRest();
  Arm(now);
}

void Upstream::Link::Arm(Instant now) {
  std::optional<Instant> next = queue_.Deadline();
  const auto consider = [&next](std::optional<Instant> at) { next = Soonest({next, at}); };
  if (connection_ && !connection_->connected()) consider(connect_by_);
  consider(on_wire_.Deadline());
  if (!queue_.empty()) consider(on_wire_.TriedOutAt(now));
  if (!next) {
    timer_.cancel();
    return;
  }
  timer_.expires_after(*next - now);
  timer_.async_wait([self = shared_from_this()](const asio::error_code& error) {
    if (!error) self->Work();
  });
}

// ---------------------------------------------------------------- answers without a reply

void Upstream::Link::ExpireWaiting(Instant now) {
  std::string why = "the deadline of the request passed before it was sent";
  if (connection_ && !connection_->connected()) why += ", while " + name_ + " was being connected";
  AnswerUnsent(queue_.TakeExpired(now), Outcome::no_reply, why);
}

void Upstream::Link::RefusePaused(Instant now) {
  for (const std::uint8_t unit : queue_.Slaves()) {
    if (!pauses_.IsPaused(unit, now)) continue;
    AnswerUnsent(queue_.TakeOf(unit), Outcome::line_down,
                 name_ + " closed the connection when it was asked for unit " +
                     std::to_string(unit) +
                     ", so the gateway sends nothing to that unit for some seconds");
  }
}

/// Answers expired requests. If a part of a reply to an expired request has arrived, the connection
/// is renewed: should the rest never arrive, the beginning of the next reply would be taken for the
/// rest.
void Upstream::Link::ExpireSent(Instant now) {
  const std::vector<Sent> expired = on_wire_.TakeExpired(now);
  for (const Sent& sent : expired) {
    sent.Answer(Outcome::no_reply, {}, name_ + " did not answer in time");
  }
  const bool over =
      std::ranges::any_of(expired, [now](const Sent& sent) { return sent.deadline <= now; });
  if (!over || !connection_) return;
  if (on_wire_.IsSilent()) return Break("does not answer any more", now);
  if (!connection_->in_frame() || !on_wire_.IsOfExpired(connection_->frame_id())) return;
  TakeBackReads(nullptr);
  Break("did not finish a reply", now);
}

void Upstream::Link::AnswerUnsent(const std::vector<bus::RoutedRequest>& requests, Outcome outcome,
                                  const std::string& reason) {
  const Instant now = clock_();
  for (const bus::RoutedRequest& request : requests) {
    bus::RoutedReply reply;
    reply.outcome = outcome;
    reply.reason = reason;
    reply.waited = now - request.arrived;
    request.done(std::move(reply));
  }
}

// ---------------------------------------------------------------- the connection

void Upstream::Link::Connect(Instant now) {
  connection_ = std::make_shared<UpstreamConnection>(io_, *this);
  connect_by_ = now + kConnectTimeout;
  on_wire_.OnConnecting(now);
  connection_->Open(host_, port_, tls_);
}

void Upstream::Link::OnConnected() {
  log::Info("modbus: {}: connected", name_);
  reconnect_.OnConnected();
  Work();
}

/// Handles the end of the connection. If no part of a reply has arrived, the reads on the wire are
/// sent again, as far as RequestsOnWire::TakeReads allows.
void Upstream::Link::OnBroken(const std::string& reason) {
  const Instant now = clock_();
  if (connection_->connected() && !connection_->in_frame()) {
    const Sent* const suspect = on_wire_.Suspect();
    if (suspect != nullptr) pauses_.OnClosed(suspect->unit, now);
    TakeBackReads(suspect);
  }
  Break(reason, now);
  Work();
}

void Upstream::Link::TakeBackReads(const Sent* reason) {
  for (bus::RouteQueue::Batch& reads : on_wire_.TakeReads(reason)) queue_.Return(std::move(reads));
}

void Upstream::Link::Break(const std::string& reason, Instant now) {
  const bool accepted = connection_->connected();
  std::exchange(connection_, nullptr)->Close();
  const std::string text = name_ + " " + reason;
  if (reconnect_.OnBroken(accepted, text, now)) log::Warn("modbus: {}", text);
  for (const Sent& sent : on_wire_.TakeAll()) sent.Answer(Outcome::no_reply, {}, text);
}

// ---------------------------------------------------------------- the class Upstream

Upstream::Upstream(asio::io_context& io, std::string host, std::uint16_t port,
                   const config::TlsFiles& tls, OnLate on_late, Clock clock)
    : link_(std::make_shared<Link>(io, std::move(host), port, tls, std::move(on_late),
                                   std::move(clock))) {}

Upstream::~Upstream() { Stop(); }

void Upstream::Start() { link_->Start(); }
void Upstream::Rest() { link_->Rest(); }
void Upstream::Stop() { link_->Stop(); }
bool Upstream::Submit(bus::RoutedRequest request) { return link_->Submit(std::move(request)); }
void Upstream::Abandon(std::uint64_t client) { link_->Abandon(client); }

namespace {

constexpr std::size_t kShownOfReply = 16;  // bytes of a reply that an error message shows

}  // namespace

void Upstream::Link::Pump(Instant now) {
  while (connection_ && !on_wire_.full()) {
    bus::RouteQueue::Batch batch = Choose(now);
    if (batch.empty()) return;
    Send(std::move(batch), now);
  }
}

bus::RouteQueue::Batch Upstream::Link::Choose(Instant now) {
  const auto may_follow = [this](const bus::RoutedRequest& request) {
    return on_wire_.MayFollow(request);
  };
  const bool trying_out = on_wire_.IsTryingOut(now);
  const auto may_ask = [&](const bus::RoutedRequest& request) {
    if (trying_out && request.tries > 0) return false;
    return on_wire_.HasRoom(request.slave) && may_follow(request);
  };
  bus::RouteQueue::Batch batch = queue_.TakeUrgent(may_follow);
  for (const auto priority :
       {config::Priority::high, config::Priority::normal, config::Priority::low}) {
    if (batch.empty()) batch = queue_.Take(priority, may_ask);
  }
  return batch;
}

void Upstream::Link::Send(bus::RouteQueue::Batch batch, Instant now) {
  Sent sent = on_wire_.Number(std::move(batch), now);
  const Status status = connection_->Send(AduOf(sent.id, sent.unit, sent.pdu));
  if (status && sent.requests[0].broadcast) return sent.Answer(Outcome::ok, {}, "");
  on_wire_.Add(std::move(sent));
  if (!status) Break(status.error(), now);
}

std::size_t Upstream::Link::LengthOf(View head, std::size_t told) const {
  return LengthOfReply(on_wire_.PduOf(TransactionOf(head), UnitOf(head)), PduOf(head), told);
}

void Upstream::Link::OnFrame(View frame) {
  const std::uint8_t unit = UnitOf(frame);
  pauses_.OnAnswer(unit);
  const auto [sent, late] = on_wire_.TakeReplied(TransactionOf(frame), unit);
  if (late) on_late_(unit);
  if (!sent) return;
  if (unit != sent->unit) {
    return sent->Answer(Outcome::unexpected, {},
                        name_ + " answered for unit " + std::to_string(unit));
  }
  // The id has identified the request of this reply. Exception and function code are checked here;
  // the client checks all other bytes.
  const View pdu = PduOf(frame);
  const bool refused = pdu[0] == (sent->function() | kExceptionBit) && pdu.size() == 2;
  if (refused) return sent->Answer(Outcome::refused, pdu, "");
  if (pdu[0] == sent->function()) return sent->Answer(Outcome::ok, pdu, "");
  sent->Answer(Outcome::unexpected, {},
               name_ + " sent an answer that does not fit the request: " +
                   ToHex(pdu.first(std::min(pdu.size(), kShownOfReply))));
}

}  // namespace baudgate::modbus
