// SPDX-License-Identifier: Apache-2.0
#include "tests/system/taken_server.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <string_view>

namespace baudgate::system_test {
namespace {

bool IsReadable(int descriptor) {
  pollfd wanted{descriptor, POLLIN, 0};
  return ::poll(&wanted, 1, 20) > 0;
}

}  // namespace

TakenServer::TakenServer(std::uint16_t port)
    : port_(port), socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  const int yes = 1;
  ::setsockopt(socket_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  listening_ = ::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 &&
               ::listen(socket_, 8) == 0;
  if (listening_) thread_ = std::jthread([this](const std::stop_token& stop) { Run(stop); });
}

TakenServer::~TakenServer() {
  thread_ = {};  // stops and joins the thread, which uses the members below
  ::close(socket_);
}

std::size_t TakenServer::connections() const {
  const std::lock_guard lock(mutex_);
  return accepted_.size();
}

Duration TakenServer::Between(std::size_t first, std::size_t second) const {
  const std::lock_guard lock(mutex_);
  return accepted_.at(second) - accepted_.at(first);
}

void TakenServer::Run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    if (!IsReadable(socket_)) continue;
    const int client = ::accept4(socket_, nullptr, nullptr, SOCK_CLOEXEC);
    if (client < 0) continue;
    const std::size_t turn = connections();
    serve_ ? Echo(client, stop) : TurnAway(client, turn);
    ::close(client);
    const std::lock_guard lock(mutex_);
    accepted_.push_back(std::chrono::steady_clock::now());
  }
}

void TakenServer::TurnAway(int client, std::size_t turn) const {
  if (turn % 3 == 1) {
    const linger reset{1, 0};
    ::setsockopt(client, SOL_SOCKET, SO_LINGER, &reset, sizeof reset);
  } else if (turn % 3 == 2) {
    constexpr std::string_view kWord = "Port already in use\r\n";
    (void)::send(client, kWord.data(), kWord.size(), MSG_NOSIGNAL);
  }
}

void TakenServer::Echo(int client, const std::stop_token& stop) const {
  while (!stop.stop_requested()) {
    if (!IsReadable(client)) continue;
    char buffer[256];
    const ssize_t count = ::recv(client, buffer, sizeof buffer, 0);
    if (count <= 0) return;
    (void)::send(client, buffer, static_cast<std::size_t>(count), MSG_NOSIGNAL);
  }
}

}  // namespace baudgate::system_test
