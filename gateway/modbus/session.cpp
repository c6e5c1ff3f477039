// Reads, answers and paces one client.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/modbus/session.h"

#include <algorithm>
#include <asio/buffer.hpp>
#include <asio/post.hpp>
#include <asio/write.hpp>
#include <utility>

namespace baudgate::modbus {
namespace {

/// Frames of one client that are answered before the others have their turn.
constexpr int kFramesPerTurn = 8;
/// Writes of one client that may wait for its lines; more are answered "busy".
constexpr std::size_t kMaxPending = 16;

}  // namespace

ModbusSession::ModbusSession(asio::ip::tcp::socket socket, const config::Listener& listener,
                             Service& service, std::string peer, Instant now,
                             std::function<void(ModbusSession&)> closed)
    : socket_(std::move(socket)),
      listener_(listener),
      service_(service),
      peer_(std::move(peer)),
      on_closed_(std::move(closed)),
      last_frame_(now),
      sending_since_(now) {}

void ModbusSession::Start() {
  asio::error_code ignored;
  socket_.set_option(asio::ip::tcp::no_delay(true), ignored);
  socket_.set_option(asio::socket_base::keep_alive(true), ignored);
  asio::error_code failed;
  socket_.non_blocking(true, failed);
  if (failed) return Close();
  Read();
}

void ModbusSession::Close() {
  if (closed_) return;
  closed_ = true;
  asio::error_code ignored;
  socket_.close(ignored);
  pending_.clear();
  on_closed_(*this);
}

void ModbusSession::Read() {
  reading_ = true;
  // Waiting first and reading once saves the read that asio would try in vain after every answer.
  socket_.async_wait(asio::socket_base::wait_read,
                     [self = shared_from_this()](const asio::error_code& failed) {
                       self->reading_ = false;
                       if (self->closed_) return;
                       if (failed) return self->Close();
                       self->Receive();
                     });
}

void ModbusSession::Receive() {
  const auto space = assembler_.Space();
  asio::error_code failed;
  const std::size_t count = socket_.read_some(asio::buffer(space.data(), space.size()), failed);
  if (failed == asio::error::would_block) return Read();
  if (failed) return Close();
  assembler_.Commit(count);
  if (sending_.empty()) Turn();
}

void ModbusSession::Turn() {
  const Instant now = ReadClocks().instant;
  for (int i = 0; i < kFramesPerTurn && !closed_ && sending_.empty(); ++i) {
    View frame;
    const auto state = assembler_.Take(frame);
    if (state == MbapAssembler::State::need_more) break;
    if (state == MbapAssembler::State::malformed) return CloseMalformed(now);
    Handle(frame, now);
  }
  if (closed_) return;
  Flush();
  Continue();
}

void ModbusSession::Continue() {
  if (closed_ || reading_ || turn_posted_ || !sending_.empty()) return;
  if (assembler_.Peek() == MbapAssembler::State::need_more) return Read();
  turn_posted_ = true;
  asio::post(socket_.get_executor(), [self = shared_from_this()] {
    self->turn_posted_ = false;
    if (!self->closed_ && self->sending_.empty()) self->Turn();
  });
}

void ModbusSession::Handle(View frame, Instant now) {
  last_frame_ = now;
  LiveCounters::Add(service_.counters().requests);
  ModbusRequest request;
  ExceptionCode exception = service_.Check(frame, listener_.write, request);
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
}

void ModbusSession::Answer(const ModbusRequest& request) {
  Responder& responder = service_.responder();
  const bool alone = assembler_.Peek() == MbapAssembler::State::need_more;
  if (alone && out_.empty() && sending_.empty()) {
    switch (responder.Send(request, socket_.native_handle())) {
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
  if (closed_ || out_.empty() || !sending_.empty()) return;
  asio::error_code failed;
  const std::size_t sent = socket_.write_some(asio::buffer(out_), failed);
  if (failed && failed != asio::error::would_block) return Close();
  out_.erase(out_.begin(), out_.begin() + static_cast<std::ptrdiff_t>(failed ? 0 : sent));
  if (out_.empty()) return;
  std::swap(out_, sending_);
  sending_since_ = ReadClocks().instant;
  asio::async_write(socket_, asio::buffer(sending_),
                    [self = shared_from_this()](const asio::error_code& error, std::size_t) {
                      if (self->closed_) return;
                      if (error) return self->Close();
                      self->sending_.clear();
                      self->Flush();
                      self->Continue();
                    });
}

void ModbusSession::Sweep(Instant now) {
  if (!sending_.empty() && now - sending_since_ > service_.limits().stall) {
    return CloseStalled(now, "it does not read its answers");
  }
  if (sending_.empty() && pending_.empty() && now - last_frame_ > listener_.idle_timeout) {
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
