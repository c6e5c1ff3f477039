// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/bare_gateway.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <deque>

#include "gateway/base/bytes.h"

namespace baudgate::bench {
namespace {

constexpr std::uint8_t kSlave = 20;
constexpr std::size_t kReplySize = 7;
constexpr std::size_t kAduSize = 12;
constexpr int kPatience = 1000;  // ms

void WriteWhole(int descriptor, View bytes) {
  while (!bytes.empty()) {
    const ssize_t count = write(descriptor, bytes.data(), bytes.size());
    if (count <= 0) return;
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
}

void Watch(int set, int descriptor) {
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.fd = descriptor;
  epoll_ctl(set, EPOLL_CTL_ADD, descriptor, &event);
}

}  // namespace

std::vector<Piece> InstantAnswer(View request) {
  return {{{}, RtuFrame(request[0], Bytes{0x03, 0x02, 0x09, 0xC4})}};
}

Bytes ReadFrame(std::uint16_t address) {
  return RtuFrame(kSlave, Bytes{0x03, static_cast<std::uint8_t>(address >> 8),
                                static_cast<std::uint8_t>(address), 0x00, 0x01});
}

Bytes ReadAdu(std::uint16_t transaction, std::uint16_t address) {
  return {static_cast<std::uint8_t>(transaction >> 8),
          static_cast<std::uint8_t>(transaction),
          0,
          0,
          0,
          6,
          kSlave,
          0x03,
          static_cast<std::uint8_t>(address >> 8),
          static_cast<std::uint8_t>(address),
          0,
          1};
}

int OpenRaw(const std::string& path) {
  const int descriptor = open(path.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
  if (descriptor < 0) std::exit(4);
  termios settings{};
  tcgetattr(descriptor, &settings);
  cfmakeraw(&settings);
  tcsetattr(descriptor, TCSANOW, &settings);
  return descriptor;
}

bool ReadWhole(int descriptor, std::uint8_t* to, std::size_t count) {
  while (count > 0) {
    pollfd ready{descriptor, POLLIN, 0};
    if (poll(&ready, 1, kPatience) <= 0) return false;
    const ssize_t got = read(descriptor, to, count);
    if (got <= 0) return false;
    to += got;
    count -= static_cast<std::size_t>(got);
  }
  return true;
}

BareGateway::BareGateway(const std::string& tty)
    : tty_(OpenRaw(tty)), listener_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  const auto name = reinterpret_cast<sockaddr*>(&address);
  if (bind(listener_, name, size) != 0 || listen(listener_, 128) != 0) std::exit(4);
  getsockname(listener_, name, &size);
  port_ = ntohs(address.sin_port);
  thread_ = std::thread([this] { Run(); });
}

BareGateway::~BareGateway() {
  stop_ = true;
  thread_.join();
  close(listener_);
  close(tty_);
}

void BareGateway::Run() {
  const int set = epoll_create1(EPOLL_CLOEXEC);
  Watch(set, listener_);
  Watch(set, tty_);
  struct Waiting {
    int client;
    std::array<std::uint8_t, kAduSize> adu;
  };
  std::deque<Waiting> queue;
  std::array<std::uint8_t, 512> reply;
  std::size_t held = 0;
  const auto start = [&] {
    const auto& adu = queue.front().adu;
    Bytes frame(adu.begin() + 6, adu.end());
    AppendCrc16(frame);
    WriteWhole(tty_, frame);
  };
  std::array<epoll_event, 64> events;
  while (!stop_) {
    const int count = epoll_wait(set, events.data(), events.size(), 100);
    for (int i = 0; i < count; ++i) {
      const int ready = events[static_cast<std::size_t>(i)].data.fd;
      if (ready == listener_) {
        const int client = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
        const int on = 1;
        setsockopt(client, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
        Watch(set, client);
      } else if (ready == tty_) {
        const ssize_t got = read(tty_, reply.data() + held, reply.size() - held);
        held += static_cast<std::size_t>(std::max<ssize_t>(got, 0));
        if (held < kReplySize) continue;
        held = 0;
        const Waiting done = queue.front();
        queue.pop_front();
        Bytes answer = {done.adu[0], done.adu[1], 0, 0, 0, kReplySize - 2};
        Append(answer, View(reply.data(), kReplySize - 2));
        WriteWhole(done.client, answer);
        if (!queue.empty()) start();
      } else {
        Waiting waiting{ready, {}};
        if (read(ready, waiting.adu.data(), kAduSize) != static_cast<ssize_t>(kAduSize)) {
          close(ready);
          continue;
        }
        queue.push_back(waiting);
        if (queue.size() == 1) start();
      }
    }
  }
  close(set);
}

}  // namespace baudgate::bench
