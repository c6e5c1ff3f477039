// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/server/client_session.h"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <asio/error.hpp>
#include <cerrno>
#include <utility>

#include "gateway/base/system_trouble.h"
#include "gateway/outputs/modbus/wire/request.h"

namespace baudgate::modbus {

namespace {

/// The number of clients that are served in a row before the io_context does other work.
constexpr std::size_t kServedInARow = 256;

}  // namespace

Status ClientPoll::Open() {
  const int set = ::epoll_create1(EPOLL_CLOEXEC);
  if (set < 0) return Error{SystemTrouble(errno)};
  asio::error_code failed;
  set_.assign(set, failed);
  if (failed) {
    ::close(set);
    return Error{"the gateway cannot wait for requests of Modbus clients: " + failed.message()};
  }
  return {};
}

void ClientPoll::Close() {
  unserved_ = {};
  asio::error_code ignored;
  set_.close(ignored);
}

bool ClientPoll::Add(int socket, Client& client, std::uint32_t events) {
  epoll_event event{};
  event.events = events;
  event.data.ptr = &client;
  only_ = nullptr;
  if (::epoll_ctl(set_.native_handle(), EPOLL_CTL_ADD, socket, &event) != 0) return false;
  ++count_;
  return true;
}

bool ClientPoll::Change(int socket, Client& client, std::uint32_t events) {
  epoll_event event{};
  event.events = events;
  event.data.ptr = &client;
  only_ = nullptr;
  return ::epoll_ctl(set_.native_handle(), EPOLL_CTL_MOD, socket, &event) == 0;
}

void ClientPoll::Remove(int socket, Client& client) {
  only_ = nullptr;
  if (set_.is_open() && ::epoll_ctl(set_.native_handle(), EPOLL_CTL_DEL, socket, nullptr) == 0) {
    --count_;
  }
  for (epoll_event& event : unserved_) {
    if (event.data.ptr == &client) event.data.ptr = nullptr;
  }
}

void ClientPoll::Wait() {
  // async_wait reports at once if a client is ready already, so no client is missed between two
  // waits.
  set_.async_wait(asio::posix::stream_descriptor::wait_read,
                  [self = shared_from_this()](const asio::error_code& failed) {
                    if (failed || !self->set_.is_open()) return;
                    self->Serve();
                    if (self->set_.is_open()) self->Wait();
                  });
}

void ClientPoll::Serve() {
  // only_ is the only client and waits for nothing but input, so the event needs no epoll_wait.
  if (only_ != nullptr) return only_->OnEvents(EPOLLIN, ReadClocks());
  // A single client sends nothing more before it has read its reply, so a second epoll_wait is
  // useless.
  const std::size_t worth = count_ > 1 ? 1 : 2;
  std::size_t served = 0;
  std::size_t batch = 0;
  do {
    batch = ServeBatch();
    served += batch;
  } while (batch >= worth && served < kServedInARow);
}

std::size_t ClientPoll::ServeBatch() {
  if (!set_.is_open()) return 0;
  const int count =
      ::epoll_wait(set_.native_handle(), events_.data(), static_cast<int>(events_.size()), 0);
  if (count <= 0) return 0;
  if (count_ == 1 && events_[0].events == EPOLLIN) {
    only_ = static_cast<Client*>(events_[0].data.ptr);
  }
  const Now now = ReadClocks();
  unserved_ = std::span(events_).first(static_cast<std::size_t>(count));
  while (!unserved_.empty()) {
    const epoll_event event = unserved_.front();
    unserved_ = unserved_.subspan(1);
    auto* const client = static_cast<Client*>(event.data.ptr);
    if (client != nullptr) client->OnEvents(event.events, now);
  }
  return static_cast<std::size_t>(count);
}

namespace {

bool IsForNow(int error) { return error == EAGAIN || error == EWOULDBLOCK || error == EINTR; }

}  // namespace

bool ClientSocket::Start() {
  watched_ = EPOLLIN;
  return poll_.Add(socket_, client_, watched_);
}

bool ClientSocket::Watch(std::uint32_t events) {
  if (watched_ == events) return true;
  watched_ = events;
  return poll_.Change(socket_, client_, events);
}

void ClientSocket::Close() {
  if (socket_ < 0) return;
  poll_.Remove(socket_, client_);
  if (channel_) channel_->End();
  ::close(std::exchange(socket_, -1));
}

std::optional<std::size_t> ClientSocket::Receive(std::span<std::uint8_t> space) {
  if (channel_) {
    const auto moved = channel_->Read(space);
    if (moved.error == asio::error::would_block) return std::nullopt;
    return moved.count;
  }
  const ssize_t count = ::recv(socket_, space.data(), space.size(), 0);
  if (count < 0 && IsForNow(errno)) return std::nullopt;
  return static_cast<std::size_t>(std::max<ssize_t>(count, 0));
}

bool ClientSocket::Flush(Instant now) {
  if (channel_) {
    std::size_t taken = 0;
    std::error_code failed;
    while (taken < unsent_.size() && !failed) {
      const auto moved = channel_->Write(View(unsent_).subspan(taken));
      taken += moved.count;
      failed = moved.error;
    }
    if (failed && failed != asio::error::would_block) return false;
    unsent_.erase(unsent_.begin(), unsent_.begin() + static_cast<std::ptrdiff_t>(taken));
  } else if (!unsent_.empty()) {
    const ssize_t sent = ::send(socket_, unsent_.data(), unsent_.size(), MSG_NOSIGNAL);
    if (sent < 0 && !IsForNow(errno)) return false;
    unsent_.erase(unsent_.begin(), unsent_.begin() + std::max<ssize_t>(sent, 0));
  }
  if (!blocked_ && !unsent_.empty()) blocked_since_ = now;
  blocked_ = !unsent_.empty();
  return true;
}

namespace {

/// The number of frames of one client that are answered before other clients are served.
constexpr int kFramesPerTurn = 8;
/// After this silence an incomplete RTU frame is not continued, because RTU frames have no end
/// mark. ASCII frames can pause longer.
constexpr Duration kLongestGap = 50ms;
constexpr Duration kLongestAsciiGap = 1s;

}  // namespace

ClientSession::ClientSession(Accepted accepted, ClientPoll& clients,
                             const config::Listener& listener, ServerShared& shared, const Now& now,
                             Owner& owner)
    : socket_(accepted.socket, std::move(accepted.channel), clients, *this, now.instant),
      listener_(listener),
      shared_(shared),
      peer_(std::move(accepted.peer)),
      owner_(owner),
      framing_(MakeFraming(listener.framing, shared.frames())),
      requests_(listener, shared, *this, peer_, accepted.priority, accepted.rights, now),
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
  // A client whose replies block, or whose turn is posted, is not read now. If its connection
  // fails, it is closed without reading the rest, because no reply could reach it.
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

/// For RTU and ASCII: drops the replies to earlier requests. Returns whether `frame` must be
/// handled: only the last of several complete frames is, because after a delay the network can
/// deliver a request that the client has given up together with its next request. A broadcast gets
/// no reply, so it is always handled.
bool ClientSession::Supersede(View frame) {
  requests_.Abandon();
  socket_.unsent().clear();
  const bool last = framing_->Peek() != ClientFraming::State::frame;
  return last || (UnitOf(frame) == 0 && IsPlainWrite(FunctionOf(frame)));
}

void ClientSession::Continue() {
  if (closed_) return;
  if (socket_.is_blocked()) return Watch(EPOLLOUT);
  const bool waits = framing_->Peek() == ClientFraming::State::need_more;
  if (waits && !socket_.HasPending()) return Watch(EPOLLIN);
  Watch(0);
  if (closed_) return;
  socket_.PostTurn([self = shared_from_this()](const Now& now) {
    if (self->closed_ || self->socket_.is_blocked()) return;
    if (self->socket_.HasPending()) self->Fill(now.instant);
    if (!self->closed_) self->Turn(now);
  });
}

void ClientSession::Answer(const ModbusRequest& request, Responder& responder, Instant now) {
  const auto self = Hold();
  if (!SendAtOnce(request, responder) && !closed_) {
    Bytes frame;
    responder.Append(request, frame);
    framing_->Append(socket_.unsent(), frame);
  }
  Answered(now);
}

bool ClientSession::SendAtOnce(const ModbusRequest& request, Responder& responder) {
  if (!socket_.unsent().empty() || framing_->one_at_a_time() || socket_.is_encrypted()) {
    return false;
  }
  if (framing_->Peek() != ClientFraming::State::need_more) return false;
  switch (responder.Send(request, socket_.number())) {
    case Responder::Sent::whole:
      return true;
    case Responder::Sent::would_block:
      break;
    // A reply is cut when earlier replies, which the client does not read, fill the send buffer.
    case Responder::Sent::cut:
      CloseStalled("the client does not read its replies, and there is no room for more of them");
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
  // If the client has sent more bytes since its request, they can be a new request, which means
  // that the client no longer waits for this reply.
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
    return CloseStalled("the client does not read its replies");
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

/// Closes a client that uses another framing (e.g. RTU instead of TCP). Must be called before the
/// first frame was recognised. Returns false if the bytes can still become a frame.
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

void ClientSession::CloseForRoom() {
  LiveCounters::Add(shared_.counters().idle);
  WarnOfClient(peer_, "closed: idle",
               "a new client replaced it, because max_clients are connected and it had sent no "
               "request for the longest time. Raise max_clients if all clients are needed");
  Close();
}

void ClientSession::CloseStalled(std::string_view why) {
  LiveCounters::Add(shared_.counters().stalled);
  WarnOfClient(peer_, "closed: stalled", why);
  Close();
}

}  // namespace baudgate::modbus
