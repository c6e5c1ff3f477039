// Waits for the clients' sockets and serves them in batches.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/server/client_poll.h"

#include <unistd.h>

#include <cerrno>

#include "gateway/base/system_trouble.h"

namespace baudgate::modbus {
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

}  // namespace baudgate::modbus
