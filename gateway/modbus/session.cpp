// Reads, answers and paces one client.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/modbus/session.h"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <utility>

namespace baudgate::modbus {
namespace {

/// Frames of one client that are answered before the others have their turn.
constexpr int kFramesPerTurn = 8;
/// Writes of one client that may wait for its lines; more are answered "busy".
constexpr std::size_t kMaxPending = 16;

}  // namespace

ModbusSession::ModbusSession(int socket, ClientPoll& clients, const config::Listener& listener,
                             Service& service, std::string peer, Instant now,
                             std::function<void(ModbusSession&)> closed)
    : socket_(socket),
      clients_(clients),
      listener_(listener),
      service_(service),
      peer_(std::move(peer)),
      on_closed_(std::move(closed)),
      last_frame_(now),
      blocked_since_(now) {}

ModbusSession::~ModbusSession() { Release(); }

void ModbusSession::Start() {
  watched_ = EPOLLIN;
  if (!clients_.Add(socket_, *this, watched_)) Close();
}

void ModbusSession::Release() {
  if (socket_ < 0) return;
  clients_.Remove(socket_, *this);
  ::close(std::exchange(socket_, -1));
}

void ModbusSession::Close() {
  if (closed_) return;
  closed_ = true;
  Release();
  pending_.clear();
  on_closed_(*this);
}

void ModbusSession::OnEvents(std::uint32_t events) {
  const auto self = shared_from_this();
  // Not read to its end now, because it is paced; but whatever it says, no answer can reach it.
  if ((events & (EPOLLERR | EPOLLHUP)) != 0 && (watched_ & EPOLLIN) == 0) return Close();
  if (!blocked_) return Receive();
  Flush();
  Continue();
}

void ModbusSession::Watch(std::uint32_t events) {
  if (watched_ == events) return;
  watched_ = events;
  if (!clients_.Change(socket_, *this, events)) Close();
}

void ModbusSession::Receive() {
  const auto space = assembler_.Space();
  const ssize_t count = ::recv(socket_, space.data(), space.size(), 0);
  if (count < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR)) return;
  if (count <= 0) return Close();
  assembler_.Commit(static_cast<std::size_t>(count));
  Turn();
}

void ModbusSession::Turn() {
  const Instant now = std::chrono::steady_clock::now();
  for (int i = 0; i < kFramesPerTurn && !closed_ && !blocked_; ++i) {
    View frame;
    const auto state = assembler_.Take(frame);
    if (state == MbapAssembler::State::need_more) break;
    if (state == MbapAssembler::State::malformed) return CloseMalformed(now);
    Handle(frame, now);
  }
  Flush();
  Continue();
}

void ModbusSession::Continue() {
  if (closed_) return;
  if (blocked_) return Watch(EPOLLOUT);
  if (assembler_.Peek() == MbapAssembler::State::need_more) return Watch(EPOLLIN);
  Watch(0);
  if (closed_ || turn_posted_) return;
  turn_posted_ = true;
  clients_.Post([self = shared_from_this()] {
    self->turn_posted_ = false;
    if (!self->closed_ && !self->blocked_) self->Turn();
  });
}

void ModbusSession::Handle(View frame, Instant now) {
  last_frame_ = now;
  LiveCounters::Add(service_.counters().requests);
  ModbusRequest request;
  ExceptionCode exception = service_.Check(frame, listener_.permit != config::Permit::read, request);
  if (exception == ExceptionCode::none) {
    if (IsWrite(frame)) {
      exception = StartWrite(request, now);
    } else {
      exception = service_.Read(request, now);
      if (exception == ExceptionCode::none) return Answer(request);
    }
  }
  if (exception != ExceptionCode::none) Refuse(frame, exception);
}

ExceptionCode ModbusSession::StartWrite(const ModbusRequest& request, Instant now) {
  if (pending_.size() >= kMaxPending) return ExceptionCode::busy;
  const std::uint64_t id = next_id_++;
  const Instant deadline = now + service_.limits().write_deadline;
  auto done = [inbox = service_.inbox(), session = weak_from_this(), id](Outcome outcome,
                                                                         const std::string&) {
    inbox->Post([session, id, outcome] {
      if (const auto self = session.lock()) self->FinishWrite(id, outcome);
    });
  };
  const auto exception = service_.Submit(request, deadline, std::move(done));
  if (exception == ExceptionCode::none) {
    pending_.push_back({id, deadline, Bytes(request.frame.begin(), request.frame.end())});
  }
  return exception;
}

void ModbusSession::FinishWrite(std::uint64_t id, Outcome outcome) {
  const auto found =
      std::ranges::find_if(pending_, [id](const Pending& pending) { return pending.id == id; });
  if (closed_ || found == pending_.end()) return;
  const Bytes frame = std::move(found->frame);
  pending_.erase(found);
  ModbusRequest request;
  ExceptionCode exception = ParseRequest(frame, request);
  if (exception == ExceptionCode::none) exception = Service::ExceptionOf(outcome);
  if (exception == ExceptionCode::none) {
    Answer(request);
  } else {
    Refuse(frame, exception);
  }
  Flush();
  Continue();
}

void ModbusSession::Answer(const ModbusRequest& request) {
  Responder& responder = service_.responder();
  const bool alone = assembler_.Peek() == MbapAssembler::State::need_more;
  if (alone && out_.empty()) {
    switch (responder.Send(request, socket_)) {
      case Responder::Sent::whole:
        return;
      case Responder::Sent::would_block:
        break;
      // The client has left the kernel's whole send buffer unread.
      case Responder::Sent::cut:
        return CloseStalled(last_frame_, "its answers pile up unread");
      case Responder::Sent::failed:
        return Close();
    }
  }
  if (!responder.Append(request, out_)) Close();
}

void ModbusSession::Refuse(View frame, ExceptionCode exception) {
  LiveCounters::Add(service_.counters().exceptions);
  Append(out_, ExceptionReply(frame, exception));
}

void ModbusSession::Flush() {
  if (closed_) return;
  if (!out_.empty()) {
    const ssize_t sent = ::send(socket_, out_.data(), out_.size(), MSG_NOSIGNAL);
    if (sent < 0 && errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR) return Close();
    out_.erase(out_.begin(), out_.begin() + std::max<ssize_t>(sent, 0));
  }
  if (!blocked_ && !out_.empty()) blocked_since_ = std::chrono::steady_clock::now();
  blocked_ = !out_.empty();
}

void ModbusSession::Sweep(Instant now) {
  if (blocked_ && now - blocked_since_ > service_.limits().stall) {
    return CloseStalled(now, "it does not read its answers");
  }
  if (!blocked_ && pending_.empty() && now - last_frame_ > listener_.idle_timeout) {
    LiveCounters::Add(service_.counters().idle);
    return Close();
  }
  std::vector<std::uint64_t> late;
  for (const Pending& pending : pending_) {
    if (now >= pending.deadline) late.push_back(pending.id);
  }
  const auto self = shared_from_this();
  for (const std::uint64_t id : late) FinishWrite(id, Outcome::no_reply);
}

void ModbusSession::CloseMalformed(Instant now) {
  Flush();
  if (closed_) return;
  LiveCounters::Add(service_.counters().malformed);
  service_.log().Note(FoldedLog::Kind::malformed, now, peer_, assembler_.Defect());
  Close();
}

void ModbusSession::CloseStalled(Instant now, std::string_view why) {
  LiveCounters::Add(service_.counters().stalled);
  service_.log().Note(FoldedLog::Kind::stalled, now, peer_, why);
  Close();
}

}  // namespace baudgate::modbus
