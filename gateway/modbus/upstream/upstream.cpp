// The server elsewhere: requests come in, wait, expire and are answered; the connection is made,
// and made anew.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/modbus/upstream/upstream.h"

#include <algorithm>
#include <asio/dispatch.hpp>
#include <asio/post.hpp>
#include <optional>
#include <utility>

#include "gateway/base/log.h"
#include "gateway/modbus/upstream/upstream_link.h"

namespace baudgate::modbus {
namespace {

constexpr Duration kConnectTimeout = 5s;  // name look-up and connection together
/// A server that returns is not kept waiting longer: only a request makes us look for it.
constexpr Duration kLongestPause = 5s;
constexpr std::size_t kMostExpired = 64;

}  // namespace

// ---------------------------------------------------------------- from any thread

bool Upstream::Link::Submit(RoutedRequest request) {
  const MutexLock lock(mutex_);
  if (!accepting_ || waiting_ >= RouteQueue::LimitFor(request, kMostWaiting)) return false;
  ++waiting_;
  incoming_.push_back(std::move(request));
  if (incoming_.size() == 1) {
    asio::post(io_, [self = shared_from_this()] { self->TakeIncoming(); });
  }
  return true;
}

void Upstream::Link::Forget(std::uint64_t client) {
  // At once where it can be, so that it does not meet what the client asks next.
  asio::dispatch(io_, [self = shared_from_this(), client] { self->Drop(client); });
}

// ---------------------------------------------------------------- on the server's thread

void Upstream::Link::Start() {
  resting_ = false;
  const MutexLock lock(mutex_);
  accepting_ = true;
}

void Upstream::Link::Rest() {
  resting_ = true;
  CloseAtRest();
}

void Upstream::Link::CloseAtRest() {
  if (!resting_ || !connection_ || waiting_ > 0 || !on_wire_.empty()) return;
  std::exchange(connection_, nullptr)->Close();
  log::Info("modbus: {}: disconnected, as no route leads there any more", name_);
}

void Upstream::Link::Stop() {
  {
    const MutexLock lock(mutex_);
    if (!accepting_) return;
    accepting_ = false;
    for (RoutedRequest& request : incoming_) queue_.Push(std::move(request));
    incoming_.clear();
  }
  timer_.cancel();
  if (connection_) std::exchange(connection_, nullptr)->Close();
  const std::string why = "the gateway is stopping";
  for (const Sent& sent : std::exchange(on_wire_, {})) {
    AnswerSent(sent, Outcome::no_reply, {}, why);
  }
  AnswerUnsent(queue_.TakeAll(), Outcome::line_down, why);
}

void Upstream::Link::TakeIncoming() {
  if (Gather()) Work();
}

/// False: it has stopped.
bool Upstream::Link::Gather() {
  const MutexLock lock(mutex_);
  if (!accepting_) return false;
  for (RoutedRequest& request : incoming_) queue_.Push(std::move(request));
  incoming_.clear();
  return true;
}

/// What is on the wire stays there, so that its reply is known when it comes.
void Upstream::Link::Drop(std::uint64_t client) {
  if (!Gather()) return;
  const auto its = [client](const RoutedRequest& request) { return request.client == client; };
  waiting_ -= queue_.Forget(client);
  for (Sent& sent : on_wire_) {
    std::erase_if(sent.requests, [&its](const RoutedRequest& request) {
      if (its(request)) request.done(ClientHasLeft(true));
      return its(request);
    });
  }
}

/// Whatever has happened: does what is to be done now.
void Upstream::Link::Work() {
  const Instant now = ReadClocks().instant;
  ExpireWaiting(now);
  ExpireSent(now);
  if (connection_ && !connection_->connected() && now >= connect_by_) {
    Break("does not answer; is it on and reachable?");
  }
  RefusePaused(now);
  if (connection_ && connection_->connected()) Pump(now);
  if (!connection_ && !queue_.empty()) {
    if (now >= retry_at_) {
      Connect(now);
    } else {
      AnswerUnsent(queue_.TakeAll(), Outcome::line_down, trouble_);
    }
  }
  CloseAtRest();
  Arm();
}

void Upstream::Link::Arm() {
  std::optional<Instant> next = queue_.Deadline();
  const auto consider = [&next](Instant at) { next = next ? std::min(*next, at) : at; };
  if (connection_ && !connection_->connected()) consider(connect_by_);
  for (const Sent& sent : on_wire_) {
    consider(sent.deadline);
    for (const RoutedRequest& request : sent.requests) consider(request.deadline);
    const Instant tried_out = sent.at + kTriedOut;
    if (sent.repeated() && !queue_.empty() && tried_out > ReadClocks().instant) consider(tried_out);
  }
  if (!next) {
    timer_.cancel();
    return;
  }
  timer_.expires_at(*next);
  timer_.async_wait([self = shared_from_this()](const asio::error_code& error) {
    if (!error) self->Work();
  });
}

// ---------------------------------------------------------------- answers

void Upstream::Link::ExpireWaiting(Instant now) {
  std::string why = "waited beyond its deadline";
  if (connection_ && !connection_->connected()) why += ", while " + name_ + " was being connected";
  AnswerUnsent(queue_.TakeExpired(now), Outcome::no_reply, why);
}

void Upstream::Link::RefusePaused(Instant now) {
  for (const std::uint8_t unit : queue_.Slaves()) {
    if (!pauses_.IsPaused(unit, now)) continue;
    AnswerUnsent(queue_.TakeOf(unit), Outcome::line_down,
                 name_ + " closed the connection when it was asked for unit " +
                     std::to_string(unit) + ", which is left alone for some seconds");
  }
}

void Upstream::Link::ExpireSent(Instant now) {
  for (Sent& sent : on_wire_) {
    const auto late = [now](const RoutedRequest& request) { return request.deadline <= now; };
    Sent expired{sent.id, sent.unit, sent.pdu, sent.at, sent.deadline, {}};
    std::ranges::copy_if(sent.requests, std::back_inserter(expired.requests), late);
    std::erase_if(sent.requests, late);
    AnswerSent(expired, Outcome::no_reply, {}, name_ + " did not answer in time");
    if (sent.deadline <= now) ++ignored_[sent.unit];
    if (sent.deadline <= now && sent.at >= silent_from_) {
      ++silent_;
      silent_from_ = now;
    }
  }
  const auto over = std::stable_partition(on_wire_.begin(), on_wire_.end(),
                                          [now](const Sent& sent) { return sent.deadline > now; });
  if (over == on_wire_.end()) return;
  for (auto sent = over; sent != on_wire_.end(); ++sent) expired_.push_back({sent->id, sent->unit});
  on_wire_.erase(over, on_wire_.end());
  if (expired_.size() > kMostExpired)
    expired_.erase(expired_.begin(), expired_.end() - kMostExpired);
  if (!connection_) return;
  if (silent_ >= kSilentDeadlines) return Break("does not answer any more");
  if (!HasHalfOfExpired()) return;
  TakeBackReads(nullptr);
  Break("left a reply unfinished");
}

/// Should the rest never come, the next reply would be taken for it.
bool Upstream::Link::HasHalfOfExpired() const {
  if (!connection_->in_frame()) return false;
  const auto id = connection_->frame_id();
  return on_wire_.empty() ||
         (id && std::ranges::find(expired_, *id, &Expired::id) != expired_.end());
}

void Upstream::Link::AnswerUnsent(const std::vector<RoutedRequest>& requests, Outcome outcome,
                                  const std::string& reason) {
  waiting_ -= requests.size();
  const Instant now = ReadClocks().instant;
  for (const RoutedRequest& request : requests) {
    RoutedReply reply;
    reply.outcome = outcome;
    reply.reason = reason;
    reply.waited = now - request.arrived;
    request.done(std::move(reply));
  }
}

void Upstream::Link::AnswerSent(const Sent& sent, Outcome outcome, View pdu,
                                const std::string& reason) {
  const bool unknown = outcome == Outcome::no_reply && !sent.only_reads();
  for (std::size_t i = 0; i < sent.requests.size(); ++i) {
    RoutedReply reply;
    reply.outcome = outcome;
    reply.pdu = Bytes(pdu.begin(), pdu.end());
    reply.reason = reason + (unknown ? "; the request may have been carried out" : "");
    reply.sent = true;
    reply.shared = i > 0;
    reply.waited = sent.at - sent.requests[i].arrived;
    sent.requests[i].done(std::move(reply));
  }
}

// ---------------------------------------------------------------- the connection

void Upstream::Link::Connect(Instant now) {
  connection_ = std::make_shared<UpstreamConnection>(io_, *this);
  connect_by_ = now + kConnectTimeout;
  silent_ = 0;
  silent_from_ = now;
  expired_.clear();
  connection_->Open(host_, port_);
}

void Upstream::Link::OnConnected() {
  log::Info("modbus: {}: connected", name_);
  trouble_.clear();
  ladder_.Reset();
  Work();
}

void Upstream::Link::OnBroken(const std::string& reason) {
  if (connection_->connected() && !connection_->in_frame()) OnClosed(ReadClocks().instant);
  Break(reason);
  Work();
}

/// A server that closes after its reply has not looked at what was sent meanwhile. One that closes
/// because of a request does so again when that is repeated, and of those one at a time is on the
/// wire: the latest of them was the reason.
void Upstream::Link::OnClosed(Instant now) {
  const Sent* reason = nullptr;
  for (const Sent& sent : on_wire_) {
    if (sent.repeated() && (reason == nullptr || sent.at >= reason->at)) reason = &sent;
  }
  if (reason != nullptr) pauses_.OnClosed(reason->unit, now);
  TakeBackReads(reason);
}

/// Whether the server has carried out a write cannot be known; a read may be sent once more, and
/// again where another was the reason that the connection ended.
void Upstream::Link::TakeBackReads(const Sent* reason) {
  for (auto sent = on_wire_.rbegin(); sent != on_wire_.rend(); ++sent) {
    const bool again = reason == nullptr && sent->repeated();
    if (!sent->only_reads() || again || &*sent == reason) continue;
    if (reason == nullptr) {
      for (RoutedRequest& request : sent->requests) ++request.tries;
    }
    waiting_ += sent->requests.size();
    queue_.Return(std::exchange(sent->requests, {}));
  }
}

/// The next request makes a new connection: at once when the server has accepted this one, else
/// after a pause.
void Upstream::Link::Break(const std::string& reason) {
  const bool accepted = connection_->connected();
  std::exchange(connection_, nullptr)->Close();
  retry_at_ =
      accepted ? Instant::min() : ReadClocks().instant + std::min(ladder_.Next(), kLongestPause);
  const std::string text = name_ + " " + reason;
  if (text != trouble_) log::Warn("modbus: {}", text);
  trouble_ = text;
  for (const Sent& sent : std::exchange(on_wire_, {})) {
    AnswerSent(sent, Outcome::no_reply, {}, text);
  }
}

// ---------------------------------------------------------------- the outside

Upstream::Upstream(asio::io_context& io, std::string host, std::uint16_t port,
                   std::function<void(std::uint8_t)> on_late)
    : link_(std::make_shared<Link>(io, std::move(host), port, std::move(on_late))) {}

Upstream::~Upstream() { Stop(); }

void Upstream::Start() { link_->Start(); }
void Upstream::Rest() { link_->Rest(); }
void Upstream::Stop() { link_->Stop(); }
bool Upstream::Submit(RoutedRequest request) { return link_->Submit(std::move(request)); }
void Upstream::Forget(std::uint64_t client) { link_->Forget(client); }

}  // namespace baudgate::modbus
