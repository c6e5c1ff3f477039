// Reads, answers and paces one client.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/modbus/server/client_session.h"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "gateway/modbus/server/client_log.h"
#include "gateway/modbus/wire/other_framing.h"

namespace baudgate::modbus {
namespace {

/// Frames of one client that are answered before the others have their turn.
constexpr int kFramesPerTurn = 8;
/// After so much silence a frame is not going on: RTU has no end of its own, and the end of ASCII
/// is awaited as long as its specification says.
constexpr Duration kLongestGap = 50ms;
constexpr Duration kLongestAsciiGap = 1s;

}  // namespace

ClientSession::ClientSession(int socket, ClientPoll& clients, const config::Listener& listener,
                             ServerShared& shared, std::string peer, config::Priority priority,
                             const Now& now, Owner& owner)
    : socket_(socket),
      clients_(clients),
      listener_(listener),
      shared_(shared),
      peer_(std::move(peer)),
      owner_(owner),
      framing_(MakeFraming(listener.framing, shared.frames())),
      service_(std::make_shared<RequestService>(listener, shared, *this, peer_, priority, now)),
      last_bytes_(now.instant),
      last_frame_(now.instant),
      blocked_since_(now.instant) {}

ClientSession::~ClientSession() { Release(); }

void ClientSession::Start() {
  watched_ = EPOLLIN;
  if (!clients_.Add(socket_, *this, watched_)) Close();
}

void ClientSession::Release() {
  if (socket_ < 0) return;
  clients_.Remove(socket_, *this);
  ::close(std::exchange(socket_, -1));
}

void ClientSession::Close() {
  if (closed_) return;
  closed_ = true;
  Release();
  service_->Close();
  owner_.OnClosed(*this);
}

void ClientSession::OnEvents(std::uint32_t events, const Now& now) {
  const auto self = shared_from_this();
  // Not read to its end now, because it is paced; but whatever it says, no answer can reach it.
  if ((events & (EPOLLERR | EPOLLHUP)) != 0 && (watched_ & EPOLLIN) == 0) return Close();
  if (!blocked_) return Receive(now);
  Flush(now.instant);
  Continue();
}

void ClientSession::Watch(std::uint32_t events) {
  if (watched_ == events) return;
  watched_ = events;
  if (!clients_.Change(socket_, *this, events)) Close();
}

void ClientSession::Receive(const Now& now) {
  if (framing_->Space().empty()) return Continue();
  if (Fill(now.instant)) Turn(now);
}

bool ClientSession::Fill(Instant now) {
  const auto space = framing_->Space();
  if (space.empty()) return false;
  const ssize_t count = ::recv(socket_, space.data(), space.size(), 0);
  if (count < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR)) return false;
  if (count <= 0) {
    Close();
    return false;
  }
  if (!understood_ && first_.size() < kMostLookedAt) {
    const std::size_t room = kMostLookedAt - first_.size();
    Append(first_, View(space).first(std::min(room, static_cast<std::size_t>(count))));
  }
  framing_->Commit(static_cast<std::size_t>(count));
  last_bytes_ = now;
  return true;
}

void ClientSession::Turn(const Now& now) {
  in_turn_ = true;
  auto state = ClientFraming::State::need_more;
  for (int i = 0; i < kFramesPerTurn && !closed_ && !blocked_; ++i) {
    View frame;
    state = framing_->Take(frame);
    if (state != ClientFraming::State::frame) break;
    last_frame_ = now.instant;
    understood_ = true;
    if (!framing_->one_at_a_time() || Supersede(frame)) service_->Handle(frame, now);
  }
  in_turn_ = false;
  if (!understood_ && CloseOther(now)) return;
  if (state == ClientFraming::State::malformed) return CloseMalformed(now.instant);
  Flush(now.instant);
  Continue();
}

/// Frames that lie together need not have been sent together: a network that stood still glues what
/// was given up to what was asked in its place. So the last one is answered. A client that sends to
/// all slaves waits for no answer: it gives nothing up when it goes on.
bool ClientSession::Supersede(View frame) {
  service_->Abandon();
  out_.clear();
  const bool last = framing_->Peek() != ClientFraming::State::frame;
  return last || (UnitOf(frame) == 0 && IsPlainWrite(FunctionOf(frame)));
}

void ClientSession::Continue() {
  if (closed_) return;
  if (blocked_) return Watch(EPOLLOUT);
  if (framing_->Peek() == ClientFraming::State::need_more) return Watch(EPOLLIN);
  Watch(0);
  if (closed_ || turn_posted_) return;
  turn_posted_ = true;
  clients_.Post([self = shared_from_this()](const Now& now) {
    self->turn_posted_ = false;
    if (!self->closed_ && !self->blocked_) self->Turn(now);
  });
}

void ClientSession::Answer(const ModbusRequest& request, Responder& responder, Instant now) {
  const auto self = Hold();
  if (!SendAtOnce(request, responder) && !closed_) {
    Bytes frame;
    if (!responder.Append(request, frame)) return Close();
    framing_->Append(out_, frame);
  }
  Answered(now);
}

bool ClientSession::SendAtOnce(const ModbusRequest& request, Responder& responder) {
  if (!out_.empty() || framing_->one_at_a_time()) return false;
  if (framing_->Peek() != ClientFraming::State::need_more) return false;
  switch (responder.Send(request, socket_)) {
    case Responder::Sent::whole:
      return true;
    case Responder::Sent::would_block:
      break;
    // The client has left the kernel's whole send buffer unread.
    case Responder::Sent::cut:
      CloseStalled("its answers pile up unread");
      break;
    case Responder::Sent::failed:
      Close();
      break;
  }
  return false;
}

void ClientSession::Answer(View frame, Instant now) {
  const auto self = Hold();
  framing_->Append(out_, frame);
  Answered(now);
}

void ClientSession::AnswerNothing(Instant now) {
  const auto self = Hold();
  Answered(now);
}

void ClientSession::Answered(Instant now) {
  if (in_turn_) return;
  // What the client has sent meanwhile may have made the answer pointless.
  if (framing_->one_at_a_time()) Fill(now);
  if (closed_) return;
  Flush(now);
  Continue();
}

void ClientSession::Flush(Instant now) {
  if (closed_ || (!blocked_ && framing_->HoldsMore())) return;
  if (!out_.empty()) {
    const ssize_t sent = ::send(socket_, out_.data(), out_.size(), MSG_NOSIGNAL);
    if (sent < 0 && errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR) return Close();
    out_.erase(out_.begin(), out_.begin() + std::max<ssize_t>(sent, 0));
  }
  if (!blocked_ && !out_.empty()) blocked_since_ = now;
  blocked_ = !out_.empty();
}

void ClientSession::Sweep(const Now& clocks) {
  const Instant now = clocks.instant;
  if (blocked_ && now - blocked_since_ > shared_.limits().stall) {
    return CloseStalled("it does not read its answers");
  }
  if (!blocked_ && service_->outstanding() == 0 && now - last_frame_ > listener_.idle_timeout) {
    LiveCounters::Add(shared_.counters().idle);
    return Close();
  }
  const auto self = shared_from_this();
  const bool ascii = listener_.framing == Framing::ascii;
  if (!blocked_ && now - last_bytes_ >= (ascii ? kLongestAsciiGap : kLongestGap)) {
    framing_->Settle();
    Flush(now);
    Continue();
  }
  service_->Sweep(clocks);
}

/// Before its first request was understood. False: it may still be one.
bool ClientSession::CloseOther(const Now& now) {
  const auto other = OtherFraming(first_, listener_.framing, shared_.frames());
  if (!other) return false;
  LiveCounters::Add(shared_.counters().malformed);
  shared_.book()->HeardOther(listener_.Place(), peer_, *other, listener_.framing, now.wall);
  WarnOfClient(peer_, "closed: malformed", ExplainOther(*other, listener_.framing));
  Close();
  return true;
}

void ClientSession::CloseMalformed(Instant now) {
  Flush(now);
  if (closed_) return;
  LiveCounters::Add(shared_.counters().malformed);
  WarnOfClient(peer_, "closed: malformed", framing_->Defect());
  Close();
}

void ClientSession::CloseStalled(std::string_view why) {
  LiveCounters::Add(shared_.counters().stalled);
  WarnOfClient(peer_, "closed: stalled", why);
  Close();
}

}  // namespace baudgate::modbus
