// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/server/client_socket.h"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

namespace baudgate::modbus {
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
