// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/control/control_session.h"

#include <sys/socket.h>

#include <asio/post.hpp>
#include <asio/write.hpp>
#include <atomic>
#include <utility>

#include "gateway/base/user_name.h"

namespace baudgate::control {
namespace {

/// "user:anna" of the process at the other end, as the kernel knows it.
std::string UserOf(int socket) {
  ucred peer{};
  socklen_t size = sizeof(peer);
  if (::getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) return "user:?";
  return "user:" + NameOfUser(peer.uid);
}

std::uint64_t NextNumber() {
  static std::atomic<std::uint64_t> last = 0;
  return ++last;
}

}  // namespace

std::string ControlSession::TooMany(const Limits& limits) {
  return ErrorLine("busy", std::to_string(limits.clients) +
                               " clients are connected already; end one, for example a trace");
}

ControlSession::ControlSession(Socket socket, RequestHandler& service, const Limits& limits,
                               bool may_trace, std::function<void(ControlSession&)> closed)
    : socket_(std::move(socket)),
      patience_(socket_.get_executor()),
      service_(service),
      limits_(limits),
      on_closed_(std::move(closed)),
      left_(std::make_shared<std::atomic<bool>>(false)),
      client_{UserOf(socket_.native_handle()), NextNumber(), left_},
      in_(limits.request),
      may_trace_(may_trace) {}

void ControlSession::Start() {
  BePatient(limits_.patience);
  Receive();
}

void ControlSession::Close(const std::string& farewell) {
  if (std::exchange(closed_, true)) return;
  if (!farewell.empty() && trace_ && out_.empty()) {
    asio::error_code ignored;  // a reader that has no room for it sees the end of the stream
    socket_.non_blocking(true, ignored);
    socket_.write_some(asio::buffer(farewell + "\n"), ignored);
  }
  trace_.reset();
  patience_.cancel();
  left_->store(true);
  service_.Forget(client_);
  asio::error_code ignored;
  socket_.close(ignored);
  on_closed_(*this);
}

void ControlSession::OnReload(const config::Config& config) {
  if (!trace_ || !config.lines[trace_->line()].name.empty()) return;
  Close(R"({"end":"a reload has ended this line; one of its name may run anew"})");
}

void ControlSession::BePatient(Duration patience) {
  patience_.expires_after(patience);
  patience_.async_wait([self = shared_from_this()](const asio::error_code& stopped) {
    if (!stopped) self->OnImpatience();
  });
}

void ControlSession::OnImpatience() {
  if (!asked_ || late_.empty()) return Close();
  Send(std::exchange(late_, {}), true);
}

void ControlSession::Receive() {
  socket_.async_read_some(
      asio::buffer(in_.space()),
      [self = shared_from_this()](const asio::error_code& failed, std::size_t count) {
        if (self->closed_) return;
        if (failed) return self->Close();
        self->OnReceived(count);
      });
}

void ControlSession::OnReceived(std::size_t count) {
  if (trace_) return Receive();  // only its end is of interest
  in_.Commit(count);
  if (in_.IsTooLong()) {
    return Send(ErrorLine("usage", "the request is longer than " + std::to_string(limits_.request) +
                                       " bytes"),
                true);
  }
  const auto request = in_.Take();
  if (!request) return Receive();
  Handle(*request);
}

/// Nothing is read while a request has no answer, so this alone tells that its client has left. One
/// that only says nothing more waits for its answer.
void ControlSession::WatchEnd() {
  if (std::exchange(watched_, true)) return;
  socket_.async_wait(Socket::wait_error, [self = shared_from_this()](const asio::error_code& end) {
    self->watched_ = false;
    if (!end && !self->closed_ && self->asked_) self->Close();
  });
}

void ControlSession::Handle(std::string_view request) {
  // Called on a line's thread, maybe after this session has ended.
  auto later = [weak = weak_from_this(), executor = socket_.get_executor()](std::string text) {
    asio::post(executor, [weak, text = std::move(text)]() mutable {
      const auto self = weak.lock();
      if (self && !self->closed_ && self->asked_) self->Send(std::move(text));
    });
  };
  BePatient(limits_.patience);
  asked_ = true;
  WatchEnd();
  Reply reply = service_.Answer(request, client_, ReadClocks(), later);
  if (reply.text.empty()) {
    late_ = std::move(reply.late);
    if (!late_.empty()) BePatient(limits_.disk);
    return;
  }
  if (reply.trace && !may_trace_) return Send(TooMany(limits_));
  Send(std::move(reply.text));
  if (reply.trace) StartTrace(*reply.trace);
}

void ControlSession::Send(std::string text, bool last) {
  out_ = std::move(text);
  out_ += '\n';
  asked_ = false;
  if (!trace_) BePatient(limits_.patience);
  asio::async_write(socket_, asio::buffer(out_),
                    [self = shared_from_this(), last](const asio::error_code& failed, std::size_t) {
                      if (self->closed_) return;
                      if (failed) return self->Close();
                      self->OnSent(last);
                    });
}

void ControlSession::OnSent(bool last) {
  out_ = {};
  if (last) return Close();
  if (trace_) return SendRecords();
  BePatient(limits_.patience);
  OnReceived(0);  // the next request may be here already
}

void ControlSession::StartTrace(const TraceWish& wish) {
  // Called on the line's thread, maybe after this session has ended.
  const std::weak_ptr<ControlSession> weak = weak_from_this();
  auto wake = [weak, executor = socket_.get_executor()] {
    asio::post(executor, [weak] {
      if (const auto self = weak.lock(); self && !self->closed_) self->SendRecords();
    });
  };
  auto queue = service_.control().Trace(wish.line, std::move(wake));
  if (!queue) return Close();  // it has ended this moment
  trace_.emplace(wish, std::move(queue));
  patience_.cancel();
  Receive();
}

void ControlSession::SendRecords() {
  if (!out_.empty()) return;
  std::string text = trace_->Take();
  if (!text.empty()) Send(std::move(text));
}

}  // namespace baudgate::control
