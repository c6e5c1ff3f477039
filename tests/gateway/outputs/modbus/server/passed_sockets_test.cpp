// A listening socket that systemd passes goes to the listener of its address, and to nobody else.
// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <asio/io_context.hpp>
#include <cstdlib>
#include <string>

#include "gateway/outputs/modbus/server/listener.h"

namespace baudgate::modbus {
namespace {

using asio::ip::tcp;

constexpr int kFirst = 3;  // the first descriptor that systemd passes

tcp::endpoint Loopback(std::uint16_t port) { return {asio::ip::address_v4::loopback(), port}; }

/// In a process of its own: what stands at 3 and 4 is lost.
int TakesItsOwn() {
  asio::io_context io;
  tcp::acceptor wanted(io, Loopback(0));
  tcp::acceptor other(io, Loopback(0));
  const std::uint16_t port = wanted.local_endpoint().port();
  const int sockets[] = {::fcntl(wanted.native_handle(), F_DUPFD, 100),
                         ::fcntl(other.native_handle(), F_DUPFD, 100)};
  for (int i = 0; i < 2; ++i) ::dup2(sockets[i], kFirst + i);
  ::setenv("LISTEN_PID", std::to_string(::getpid()).c_str(), 1);
  ::setenv("LISTEN_FDS", "2", 1);
  PassedSockets passed;
  if (std::getenv("LISTEN_FDS") != nullptr || std::getenv("LISTEN_PID") != nullptr) return 1;
  if (passed.Take({asio::ip::address_v4::any(), port})) return 2;
  if (passed.Take({asio::ip::address_v6::loopback(), port})) return 3;
  const auto taken = passed.Take(Loopback(port));
  if (taken != kFirst) return 4;
  if ((::fcntl(kFirst, F_GETFD) & FD_CLOEXEC) == 0) return 5;
  return passed.Take(Loopback(port)) ? 6 : 0;
}

TEST(PassedSocketsDeathTest, GoToTheListenerOfTheirAddress) {
  EXPECT_EXIT(std::_Exit(TakesItsOwn()), ::testing::ExitedWithCode(0), "");
}

TEST(PassedSockets, AreNoneForAProcessThatIsNotMeant) {
  ::setenv("LISTEN_PID", "1", 1);
  ::setenv("LISTEN_FDS", "1", 1);
  {
    PassedSockets passed;
    EXPECT_FALSE(passed.Take(Loopback(502)));
  }
  ::unsetenv("LISTEN_PID");
  ::unsetenv("LISTEN_FDS");
}

}  // namespace
}  // namespace baudgate::modbus
