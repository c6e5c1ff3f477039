// Reads, answers and paces one client.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/server/client_session.h"

#include <algorithm>
#include <utility>

#include "gateway/outputs/modbus/wire/client_framing.h"

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
    : socket_(socket, clients, *this, now.instant),
      listener_(listener),
      shared_(shared),
      peer_(std::move(peer)),
      owner_(owner),
      framing_(MakeFraming(listener.framing, shared.frames())),
      requests_(listener, shared, *this, peer_, priority, now),
      last_bytes_(now.instant),
      last_frame_(now.instant) {}

void ClientSession::Start() {
  if (!socket_.Start()) Close();
}

void ClientSession::Close() {
  if (closed_) return;
  closed_ = true;
  socket_.Close();
  requests_.Close();
  owner_.OnClosed(*this);
}

void ClientSession::OnEvents(std::uint32_t events, const Now& now) {
  const auto self = shared_from_this();
  // Not read to its end now, because it is paced; but whatever it says, no answer can reach it.
  if ((events & (EPOLLERR | EPOLLHUP)) != 0 && !socket_.is_read()) return Close();
  if (!socket_.is_blocked()) return Receive(now);
  Flush(now.instant);
  Continue();
}

void ClientSession::Watch(std::uint32_t events) {
  if (!socket_.Watch(events)) Close();
}

void ClientSession::Receive(const Now& now) {
  if (framing_->Space().empty()) return Continue();
  if (Fill(now.instant)) Turn(now);
}

bool ClientSession::Fill(Instant now) {
  const auto space = framing_->Space();
  if (space.empty()) return false;
  const auto count = socket_.Receive(space);
  if (!count) return false;
  if (*count == 0) {
    Close();
    return false;
  }
  if (first_ && first_->size() < kMostLookedAt) {
    Append(*first_, View(space).first(std::min(kMostLookedAt - first_->size(), *count)));
  }
  framing_->Commit(*count);
  last_bytes_ = now;
  return true;
}

void ClientSession::Turn(const Now& now) {
  in_turn_ = true;
  auto state = ClientFraming::State::need_more;
  for (int i = 0; i < kFramesPerTurn && !closed_ && !socket_.is_blocked(); ++i) {
    View frame;
    state = framing_->Take(frame);
    if (state != ClientFraming::State::frame) break;
    last_frame_ = now.instant;
    first_.reset();
    if (!framing_->one_at_a_time() || Supersede(frame)) requests_.Handle(frame, now);
  }
  in_turn_ = false;
  if (first_ && CloseOther(now)) return;
  if (state == ClientFraming::State::malformed) return CloseMalformed(now.instant);
  Flush(now.instant);
  Continue();
}

/// Frames that lie together need not have been sent together: a network that stood still glues what
/// was given up to what was asked in its place. So the last one is answered. A client that sends to
/// all slaves waits for no answer: it gives nothing up when it goes on.
bool ClientSession::Supersede(View frame) {
  requests_.Abandon();
  socket_.unsent().clear();
  const bool last = framing_->Peek() != ClientFraming::State::frame;
  return last || (UnitOf(frame) == 0 && IsPlainWrite(FunctionOf(frame)));
}

void ClientSession::Continue() {
  if (closed_) return;
  if (socket_.is_blocked()) return Watch(EPOLLOUT);
  if (framing_->Peek() == ClientFraming::State::need_more) return Watch(EPOLLIN);
  Watch(0);
  if (closed_) return;
  socket_.PostTurn([self = shared_from_this()](const Now& now) {
    if (!self->closed_ && !self->socket_.is_blocked()) self->Turn(now);
  });
}

void ClientSession::Answer(const ModbusRequest& request, Responder& responder, Instant now) {
  const auto self = Hold();
  if (!SendAtOnce(request, responder) && !closed_) {
    Bytes frame;
    if (!responder.Append(request, frame)) return Close();
    framing_->Append(socket_.unsent(), frame);
  }
  Answered(now);
}

bool ClientSession::SendAtOnce(const ModbusRequest& request, Responder& responder) {
  if (!socket_.unsent().empty() || framing_->one_at_a_time()) return false;
  if (framing_->Peek() != ClientFraming::State::need_more) return false;
  switch (responder.Send(request, socket_.number())) {
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
  framing_->Append(socket_.unsent(), frame);
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
  if (closed_ || (!socket_.is_blocked() && framing_->HoldsMore())) return;
  if (!socket_.Flush(now)) Close();
}

void ClientSession::Sweep(const Now& clocks) {
  const Instant now = clocks.instant;
  if (socket_.IsBlockedLonger(shared_.limits().stall, now)) {
    return CloseStalled("it does not read its answers");
  }
  if (!socket_.is_blocked() && requests_.outstanding() == 0 &&
      now - last_frame_ > listener_.idle_timeout) {
    LiveCounters::Add(shared_.counters().idle);
    return Close();
  }
  const auto self = shared_from_this();
  const bool ascii = listener_.framing == Framing::ascii;
  if (!socket_.is_blocked() && now - last_bytes_ >= (ascii ? kLongestAsciiGap : kLongestGap)) {
    framing_->Settle();
    Flush(now);
    Continue();
  }
  requests_.Sweep(clocks);
}

/// Before its first request was understood. False: it may still be one.
bool ClientSession::CloseOther(const Now& now) {
  const auto other = OtherFraming(*first_, listener_.framing, shared_.frames());
  if (!other) return false;
  LiveCounters::Add(shared_.counters().malformed);
  requests_.HeardOther(*other, now.wall);
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
