// A serial server that stops taking data for a while: what has been answered with 0x0B meanwhile
// does not reach it when it goes on.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>

#include "tests/system/messages.h"
#include "tests/system/route_station.h"

namespace baudgate::system_test {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::Each;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr std::uint16_t kCount = 120;  // registers of a write
constexpr std::uint8_t kAfter = 60;    // the unit that is written to when all is well again
constexpr std::size_t kFrame = 7 + 2 * kCount + 2;

/// Accepts connections into a kernel that holds a few requests, and reads nothing unless told to.
class StalledServer {
 public:
  StalledServer() : listening_(::socket(AF_INET, SOCK_STREAM, 0)) {
    const int small = 1;  // the kernel's least: room for some 1 KiB
    ::setsockopt(listening_, SOL_SOCKET, SO_RCVBUF, &small, sizeof small);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    const bool listens =
        ::bind(listening_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0 &&
        ::listen(listening_, 8) == 0 &&
        ::getsockname(listening_, reinterpret_cast<sockaddr*>(&address), &size) == 0;
    EXPECT_TRUE(listens);
    port_ = ntohs(address.sin_port);
  }
  ~StalledServer() { ::close(listening_); }
  StalledServer(const StalledServer&) = delete;
  StalledServer& operator=(const StalledServer&) = delete;

  std::uint16_t port() const { return port_; }

  /// The oldest connection not yet accepted.
  int Accept() const {
    return IsReady(listening_, kPatience) ? ::accept(listening_, nullptr, nullptr) : -1;
  }
  static bool IsReady(int descriptor, Duration limit) {
    pollfd waited = {descriptor, POLLIN, 0};
    return ::poll(&waited, 1, static_cast<int>(limit / 1ms)) == 1;
  }
  /// All that the connection brings until it ends, or `enough`. Closes it.
  static Bytes ReadAll(int connection, std::size_t enough) {
    Bytes bytes;
    std::array<std::uint8_t, 4096> buffer;
    while (bytes.size() < enough && IsReady(connection, kPatience)) {
      const ssize_t count = ::read(connection, buffer.data(), buffer.size());
      if (count <= 0) break;
      Append(bytes, View(buffer).first(static_cast<std::size_t>(count)));
    }
    ::close(connection);
    return bytes;
  }

 private:
  int listening_;
  std::uint16_t port_ = 0;
};

/// The units that whole write requests in there are for.
std::vector<int> UnitsIn(const Bytes& bytes) {
  std::vector<int> units;
  for (std::size_t at = 0; at + kFrame <= bytes.size(); at += kFrame) units.push_back(bytes[at]);
  return units;
}

class Stall : public RouteStation {
 protected:
  static Message Write(std::uint8_t unit) {
    Bytes pdu = {16, 0, 0, 0, kCount, 2 * kCount};
    pdu.resize(pdu.size() + 2 * std::size_t{kCount}, unit);
    return {unit, unit, pdu};
  }
};

TEST_F(Stall, OfASerialServerDeliversNothingThatWasGivenUp) {
  const StalledServer server;
  const auto daemon = StartGateway(
      Yaml({"{ units: 1-60, line: drive, deadline: 5s }"},
           "  - { name: drive, port: \"tcp://127.0.0.1:" + std::to_string(server.port()) +
               "\", protocol: modbus_rtu, timing: { reply: 200ms } }\n"));
  RawClient client(port());
  const auto lost = [&] {
    return daemon->Errors().find("takes no data: a request has not been acknowledged") !=
           std::string::npos;
  };
  // Until the server's kernel has no more room: a slave each, as silent ones are not asked again.
  std::uint8_t last = 0;
  while (!lost() && last < kAfter - 1) {
    Send(client, Write(++last));
    EXPECT_NE(ExceptionIn(Receive(client).value()), 0);
  }
  ASSERT_TRUE(Eventually(lost)) << daemon->Errors();

  const std::vector<int> units = UnitsIn(StalledServer::ReadAll(server.Accept(), 1 << 20));
  EXPECT_THAT(units, Contains(1)) << "the server's own kernel has it; out of reach";
  EXPECT_THAT(units, Not(Contains(last)));

  // The connection that follows brings the next request, and nothing from before.
  const int next = server.Accept();
  ASSERT_GE(next, 0);
  EXPECT_TRUE(Eventually([&] {
    Send(client, Write(kAfter));
    Receive(client);
    return StalledServer::IsReady(next, 0ms);
  }));
  EXPECT_THAT(UnitsIn(StalledServer::ReadAll(next, kFrame)), AllOf(Not(IsEmpty()), Each(kAfter)));
}

}  // namespace
}  // namespace baudgate::system_test
