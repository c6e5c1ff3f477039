// One connection to a Modbus TCP server: requests out by priority, replies in by transaction id.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/modbus/upstream.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <asio/dispatch.hpp>
#include <asio/post.hpp>
#include <asio/steady_timer.hpp>
#include <atomic>
#include <functional>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "gateway/modbus/mbap.h"
#include "gateway/modbus/upstream_connection.h"
#include "transports/reopen_ladder.h"
#include "gateway/route_queue.h"

namespace baudgate::modbus {
namespace {

constexpr Duration kConnectTimeout = 5s;  // name look-up and connection together
/// A server that returns is not kept waiting longer: only a request makes us look for it.
constexpr Duration kLongestPause = 5s;
constexpr std::uint8_t kException = 0x80;

Instant Clock() { return std::chrono::steady_clock::now(); }

/// Functions that only read, whoever the server is.
bool IsRead(std::uint8_t function) { return function >= 1 && function <= 4; }

bool IsBroadcast(const RoutedRequest& request) {
  const std::uint8_t function = request.pdu[0];
  const bool writes = function == 5 || function == 6 || function == 15 || function == 16;
  return request.slave == 0 && writes;
}

/// A request on the wire, with the identical reads that its reply answers as well.
struct Sent {
  std::uint16_t id = 0;
  std::uint8_t unit = 0;
  std::uint8_t function = 0;
  Instant at;
  Instant deadline;  ///< the last of its requests'
  RouteQueue::Batch requests;
};

}  // namespace

class Upstream::Link final : public std::enable_shared_from_this<Link>,
                             public UpstreamConnection::Owner {
 public:
  Link(asio::io_context& io, std::string host, std::uint16_t port, std::function<void()> on_late)
      : io_(io),
        timer_(io),
        host_(std::move(host)),
        port_(port),
        on_late_(std::move(on_late)),
        name_("server " + host_ + ":" + std::to_string(port)),
        ladder_(static_cast<std::uint32_t>(std::hash<std::string>{}(name_))) {}

  void Start();
  void Stop();
  bool Submit(RoutedRequest request);
  void Forget(std::uint64_t client);

 private:
  void OnConnected() override;
  void OnFrame(View frame) override;
  void OnFramesRead() override { Work(); }
  void OnBroken(const std::string& reason) override;

  void TakeIncoming();
  void Drop(std::uint64_t client);
  void Work();
  void Arm();

  void ExpireWaiting(Instant now);
  void ExpireSent(Instant now);
  void AnswerUnsent(const std::vector<RoutedRequest>& requests, Outcome outcome,
                    const std::string& reason);
  static void AnswerSent(const Sent& sent, Outcome outcome, View pdu, const std::string& reason);

  void Connect(Instant now);
  void Break(const std::string& reason);
  void Pump(Instant now);
  RouteQueue::Batch Choose();
  std::uint16_t FreeId();
  void Send(Instant now, RouteQueue::Batch batch);

  asio::io_context& io_;
  asio::steady_timer timer_;  // the next deadline, whatever it is for
  const std::string host_;
  const std::uint16_t port_;
  const std::function<void()> on_late_;
  const std::string name_;

  std::mutex mutex_;
  bool accepting_ = false;               // under mutex_
  std::vector<RoutedRequest> incoming_;  // under mutex_

  std::atomic<std::size_t> waiting_ = 0;  // in incoming_ and queue_

  RouteQueue queue_;
  std::vector<Sent> on_wire_;
  std::uint16_t next_id_ = 0;

  std::shared_ptr<UpstreamConnection> connection_;  // null: there is none, nor an attempt
  Instant connect_by_;
  bool answered_ = false;  // it has sent a frame, whatever that said
  int silent_ = 0;         // deadlines that passed since then
  Instant silent_from_;    // what was sent later counts as the next of them
  ReopenLadder ladder_;
  Instant retry_at_ = Instant::min();
  std::string trouble_;  // why there was no connection last time
};

// ---------------------------------------------------------------- from any thread

bool Upstream::Link::Submit(RoutedRequest request) {
  const std::lock_guard lock(mutex_);
  if (!accepting_ || waiting_ >= kMostWaiting) return false;
  ++waiting_;
  incoming_.push_back(std::move(request));
  if (incoming_.size() == 1) {
    asio::post(io_, [self = shared_from_this()] { self->TakeIncoming(); });
  }
  return true;
}

void Upstream::Link::Forget(std::uint64_t client) {
  {
    const std::lock_guard lock(mutex_);
    if (!accepting_) return;
    waiting_ -= std::erase_if(
        incoming_, [client](const RoutedRequest& request) { return request.client == client; });
  }
  // At once where it can be, so that it does not meet what the client asks next.
  asio::dispatch(io_, [self = shared_from_this(), client] { self->Drop(client); });
}

// ---------------------------------------------------------------- on the server's thread

void Upstream::Link::Start() {
  const std::lock_guard lock(mutex_);
  accepting_ = true;
}

void Upstream::Link::Stop() {
  {
    const std::lock_guard lock(mutex_);
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
  {
    const std::lock_guard lock(mutex_);
    if (!accepting_) return;
    for (RoutedRequest& request : incoming_) queue_.Push(std::move(request));
    incoming_.clear();
  }
  Work();
}

/// What is on the wire stays there, so that its reply is known when it comes.
void Upstream::Link::Drop(std::uint64_t client) {
  waiting_ -= queue_.Forget(client);
  for (Sent& sent : on_wire_) {
    std::erase_if(sent.requests,
                  [client](const RoutedRequest& request) { return request.client == client; });
  }
}

/// Whatever has happened: does what is to be done now.
void Upstream::Link::Work() {
  const Instant now = Clock();
  ExpireWaiting(now);
  ExpireSent(now);
  if (connection_ && !connection_->connected() && now >= connect_by_) {
    Break("does not answer; is it on and reachable?");
  }
  if (connection_ && connection_->connected()) Pump(now);
  if (!connection_ && !queue_.empty()) {
    if (now >= retry_at_) {
      Connect(now);
    } else {
      AnswerUnsent(queue_.TakeAll(), Outcome::line_down, trouble_);
    }
  }
  Arm();
}

void Upstream::Link::Arm() {
  std::optional<Instant> next = queue_.Deadline();
  const auto consider = [&next](Instant at) { next = next ? std::min(*next, at) : at; };
  if (connection_ && !connection_->connected()) consider(connect_by_);
  for (const Sent& sent : on_wire_) {
    consider(sent.deadline);
    for (const RoutedRequest& request : sent.requests) consider(request.deadline);
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

void Upstream::Link::ExpireSent(Instant now) {
  for (Sent& sent : on_wire_) {
    const auto over = [now](const RoutedRequest& request) { return request.deadline <= now; };
    Sent expired{sent.id, sent.unit, sent.function, sent.at, sent.deadline, {}};
    std::ranges::copy_if(sent.requests, std::back_inserter(expired.requests), over);
    std::erase_if(sent.requests, over);
    AnswerSent(expired, Outcome::no_reply, {}, name_ + " did not answer in time");
    if (sent.deadline <= now && sent.at >= silent_from_) {
      ++silent_;
      silent_from_ = now;
    }
  }
  std::erase_if(on_wire_, [now](const Sent& sent) { return sent.deadline <= now; });
  if (connection_ && silent_ >= kSilentDeadlines) Break("answers nothing any more");
}

void Upstream::Link::AnswerUnsent(const std::vector<RoutedRequest>& requests, Outcome outcome,
                                  const std::string& reason) {
  waiting_ -= requests.size();
  const Instant now = Clock();
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
  const bool unknown = outcome == Outcome::no_reply && !IsRead(sent.function);
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
  answered_ = false;
  silent_ = 0;
  silent_from_ = now;
  connection_->Open(host_, port_);
}

void Upstream::Link::OnConnected() {
  spdlog::info("modbus: {}: connected", name_);
  trouble_.clear();
  Work();
}

void Upstream::Link::OnBroken(const std::string& reason) {
  Break(reason);
  Work();
}

/// The next request makes a new connection: at once when this one has worked, else after a pause.
void Upstream::Link::Break(const std::string& reason) {
  std::exchange(connection_, nullptr)->Close();
  retry_at_ = answered_ ? Instant::min() : Clock() + std::min(ladder_.Next(), kLongestPause);
  const std::string text = name_ + " " + reason;
  if (text != trouble_) spdlog::warn("modbus: {}", text);
  trouble_ = text;
  for (const Sent& sent : std::exchange(on_wire_, {})) {
    AnswerSent(sent, Outcome::no_reply, {}, text);
  }
}

// ---------------------------------------------------------------- requests and replies

void Upstream::Link::Pump(Instant now) {
  while (connection_ && on_wire_.size() < kMostOnWire) {
    RouteQueue::Batch batch = Choose();
    if (batch.empty()) return;
    Send(now, std::move(batch));
  }
}

RouteQueue::Batch Upstream::Link::Choose() {
  const auto may_ask = [this](const RoutedRequest& request) {
    return std::ranges::none_of(on_wire_, [slave = request.slave](const Sent& sent) {
      return !IsRead(sent.function) && (slave == 0 || sent.unit == 0 || sent.unit == slave);
    });
  };
  RouteQueue::Batch batch = queue_.TakeUrgent(may_ask);
  for (const auto priority :
       {config::Priority::high, config::Priority::normal, config::Priority::low}) {
    if (batch.empty()) batch = queue_.Take(priority, may_ask);
  }
  waiting_ -= batch.size();
  return batch;
}

std::uint16_t Upstream::Link::FreeId() {
  const auto taken = [this] {
    return std::ranges::any_of(on_wire_, [this](const Sent& sent) { return sent.id == next_id_; });
  };
  while (taken()) ++next_id_;
  return next_id_++;
}

void Upstream::Link::Send(Instant now, RouteQueue::Batch batch) {
  Sent sent;
  sent.id = FreeId();
  sent.unit = batch[0].slave;
  sent.function = batch[0].pdu[0];
  sent.at = now;
  for (const RoutedRequest& request : batch) {
    sent.deadline = std::max(sent.deadline, request.deadline);
  }
  const Status status = connection_->Send(AduOf(sent.id, sent.unit, batch[0].pdu));
  const bool over = status.ok() && IsBroadcast(batch[0]);
  sent.requests = std::move(batch);
  if (over) return AnswerSent(sent, Outcome::ok, {}, "");
  on_wire_.push_back(std::move(sent));
  if (!status) Break(status.error());
}

void Upstream::Link::OnFrame(View frame) {
  answered_ = true;
  silent_ = 0;
  ladder_.Reset();
  const std::uint16_t id = *ByteReader(frame).U16Be(0);
  const auto found =
      std::ranges::find_if(on_wire_, [id](const Sent& sent) { return sent.id == id; });
  if (found == on_wire_.end()) return on_late_();
  const Sent sent = std::move(*found);
  on_wire_.erase(found);
  const View pdu = frame.subspan(kMbapHeader);
  const std::uint8_t unit = frame[kMbapHeader - 1];
  if (unit != sent.unit) {
    AnswerSent(sent, Outcome::unexpected, {}, name_ + " answered for unit " + std::to_string(unit));
  } else if (pdu[0] == sent.function) {
    AnswerSent(sent, Outcome::ok, pdu, "");
  } else if (pdu[0] == (sent.function | kException) && pdu.size() == 2) {
    AnswerSent(sent, Outcome::refused, pdu, "");
  } else {
    AnswerSent(sent, Outcome::unexpected, {}, name_ + " answered with another function");
  }
}

// ---------------------------------------------------------------- the outside

Upstream::Upstream(asio::io_context& io, std::string host, std::uint16_t port,
                   std::function<void()> on_late)
    : link_(std::make_shared<Link>(io, std::move(host), port, std::move(on_late))) {}

Upstream::~Upstream() { Stop(); }

void Upstream::Start() { link_->Start(); }
void Upstream::Stop() { link_->Stop(); }
bool Upstream::Submit(RoutedRequest request) { return link_->Submit(std::move(request)); }
void Upstream::Forget(std::uint64_t client) { link_->Forget(client); }

}  // namespace baudgate::modbus
