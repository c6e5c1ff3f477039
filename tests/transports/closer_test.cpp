// Closing away from the caller: nothing is lost, and a close that does not return holds up nobody.
// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <vector>

#include "transports/serial_port.h"

namespace baudgate {
namespace {

struct Pipe {
  Pipe() {
    int ends[2] = {-1, -1};
    EXPECT_EQ(pipe(ends), 0);
    reading = ends[0];
    writing = ends[1];
  }
  ~Pipe() { close(reading); }
  /// Blocks until the writing end is closed.
  bool SeesEnd() const {
    char byte = 0;
    return read(reading, &byte, 1) == 0;
  }
  int reading = -1;
  int writing = -1;
};

/// A TCP connection whose close() waits for a peer that does not read: what a serial driver does
/// with output that flow control holds back.
struct Stuck {
  Stuck() {
    const int listener = socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* generic = reinterpret_cast<sockaddr*>(&address);
    EXPECT_EQ(bind(listener, generic, size), 0);
    EXPECT_EQ(listen(listener, 1), 0);
    EXPECT_EQ(getsockname(listener, generic, &size), 0);
    fd = socket(AF_INET, SOCK_STREAM, 0);
    EXPECT_EQ(connect(fd, generic, size), 0);
    peer = accept(listener, nullptr, nullptr);
    close(listener);
    const linger wait{1, 120};
    EXPECT_EQ(setsockopt(fd, SOL_SOCKET, SO_LINGER, &wait, sizeof wait), 0);
    EXPECT_EQ(fcntl(fd, F_SETFL, O_NONBLOCK), 0);
    const std::vector<char> much(65536);
    while (write(fd, much.data(), much.size()) > 0) {
    }
  }
  int fd = -1;
  int peer = -1;
};

TEST(CloseElsewhere, ClosesEveryDescriptor) {
  const std::vector<Pipe> pipes(5 * kMostClosers);
  for (const Pipe& one : pipes) CloseElsewhere(one.writing);
  for (const Pipe& one : pipes) EXPECT_TRUE(one.SeesEnd());
}

TEST(CloseElsewhere, AStuckCloseHoldsUpNobody) {
  const Stuck stuck;
  CloseElsewhere(stuck.fd);
  const Pipe other;
  CloseElsewhere(other.writing);
  EXPECT_TRUE(other.SeesEnd());
  close(stuck.peer);  // lets the thread end
}

TEST(CloseElsewhere, WaitsForAThreadWhenAllAreStuck) {
  const std::vector<Stuck> stuck(kMostClosers);
  for (const Stuck& one : stuck) CloseElsewhere(one.fd);
  const Pipe other;
  CloseElsewhere(other.writing);
  close(stuck.front().peer);
  EXPECT_TRUE(other.SeesEnd());
  for (std::size_t i = 1; i < stuck.size(); ++i) close(stuck[i].peer);
}

}  // namespace
}  // namespace baudgate
