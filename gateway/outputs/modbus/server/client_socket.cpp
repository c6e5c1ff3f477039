// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/server/client_socket.h"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

#include "gateway/base/system_trouble.h"

namespace baudgate::modbus {

// Waits for the clients' sockets and serves them in batches.

namespace {

/// Then the rest of the io_context has its turn.
constexpr std::size_t kServedInARow = 256;

}  // namespace

Status ClientPoll::Open() {
  const int set = ::epoll_create1(EPOLL_CLOEXEC);
  if (set < 0) return Error{SystemTrouble(errno)};
  asio::error_code failed;
  set_.assign(set, failed);
  if (failed) {
    ::close(set);
    return Error{"the Modbus clients cannot be waited for: " + failed.message()};
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
  // Waiting again asks the kernel again, so clients that are ready already are not forgotten.
  set_.async_wait(asio::posix::stream_descriptor::wait_read,
                  [self = shared_from_this()](const asio::error_code& failed) {
                    if (failed || !self->set_.is_open()) return;
                    self->Serve();
                    if (self->set_.is_open()) self->Wait();
                  });
}

void ClientPoll::Serve() {
  // If there is one client only, the event is its own.
  if (only_ != nullptr) return only_->OnEvents(EPOLLIN, ReadClocks());
  // Alone, a client has nothing more to say before it has read its answer.
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
  ::close(std::exchange(socket_, -1));
}

std::optional<std::size_t> ClientSocket::Receive(std::span<std::uint8_t> space) {
  const ssize_t count = ::recv(socket_, space.data(), space.size(), 0);
  if (count < 0 && IsForNow(errno)) return std::nullopt;
  return static_cast<std::size_t>(std::max<ssize_t>(count, 0));
}

bool ClientSocket::Flush(Instant now) {
  if (!unsent_.empty()) {
    const ssize_t sent = ::send(socket_, unsent_.data(), unsent_.size(), MSG_NOSIGNAL);
    if (sent < 0 && !IsForNow(errno)) return false;
    unsent_.erase(unsent_.begin(), unsent_.begin() + std::max<ssize_t>(sent, 0));
  }
  if (!blocked_ && !unsent_.empty()) blocked_since_ = now;
  blocked_ = !unsent_.empty();
  return true;
}

}  // namespace baudgate::modbus
