// Tests slaves behind a route that are silent or late, whose replies look alike, or whose line is
// gone.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <numeric>

#include "tests/support/rtu_slave.h"
#include "tests/system/messages.h"
#include "tests/system/route_station.h"

namespace baudgate::system_test {
namespace {

using ::testing::ElementsAre;

constexpr const char* kTiming = "timing: { reply: 300ms }";
constexpr const char* kRoute = "{ units: 20-21, line: drive }";

class BadSlave : public RouteStation {
 protected:
  std::string OneLine(const std::string& timing = kTiming) const {
    return Yaml({kRoute}, BareLine("drive", timing));
  }

  static std::vector<std::uint16_t> Values(std::uint16_t base, int address, int count) {
    std::vector<std::uint16_t> values(static_cast<std::size_t>(count));
    std::iota(values.begin(), values.end(), static_cast<std::uint16_t>(base + address));
    return values;
  }
};

TEST_F(BadSlave, ALateReplyDoesNotAnswerTheNextRequest) {
  const ScriptedSlave slave(LinkOf("drive"), [&](View request) -> std::vector<Piece> {
    return {{AddressOf(request) == 10 ? 700ms : 0ms, RegistersReply(request, 1000)}};
  });
  ASSERT_TRUE(slave.connected());
  const auto daemon = StartGateway(OneLine("timing: { reply: 300ms, ceiling: 1200ms }"));
  RawClient client(port());
  RawClient other(port());
  Send(client, ReadRequest(9, kUnit, 9));
  ASSERT_THAT(RegistersIn(Receive(client).value()), ElementsAre(1009)) << "it is known";
  for (std::uint16_t address = 10; address < 13; ++address) {
    Send(client, ReadRequest(address, kUnit, address));
  }
  Send(other, ReadRequest(13, kUnit, 13));
  EXPECT_THAT(RegistersIn(Receive(other).value()), ElementsAre(1013));
  for (int i = 0; i < 3; ++i) {
    const Message message = Receive(client).value();
    if (message.transaction == 10) {
      EXPECT_EQ(ExceptionIn(message), kNotAnswering);
    } else {
      EXPECT_THAT(RegistersIn(message), ElementsAre(1000 + message.transaction));
    }
  }
  const Json line = Status()["lines"][0];
  EXPECT_EQ(line["late"], 1);
  EXPECT_EQ(line["stray_bytes"], 7) << "the late reply";
}

TEST_F(BadSlave, AReplyInPiecesIsReceivedWhole) {
  const ScriptedSlave slave(LinkOf("drive"), [&](View request) {
    const Bytes reply = RegistersReply(request, 1000);
    std::vector<Piece> pieces;
    constexpr std::size_t kPiece = 17;
    for (std::size_t at = 0; at < reply.size(); at += kPiece) {
      const View piece = View(reply).subspan(at, std::min(kPiece, reply.size() - at));
      pieces.push_back({at == 0 ? 0ms : 15ms, Bytes(piece.begin(), piece.end())});
    }
    return pieces;
  });
  ASSERT_TRUE(slave.connected());
  const auto daemon = StartGateway(OneLine("timing: { gap: 1s, ceiling: 10s }"));
  ModbusClient client(port());
  for (const int count : {120, 125, 1}) {
    const Registers block = client.Holding(kUnit, 999, count);
    ASSERT_TRUE(block.ok()) << block.exception;
    EXPECT_EQ(block.values, Values(1000, 999, count));
  }
  const Json route = Route("20-21");
  EXPECT_EQ(route["ok"], 3);
  EXPECT_EQ(route["no_reply"], 0);
}

TEST_F(BadSlave, ASlaveLostInABlockReturnsWithoutStaleValues) {
  const auto daemon = StartGateway(OneLine(), {});
  ModbusClient client(port());
  RawClient cut(port());
  {
    const ScriptedSlave slave(LinkOf("drive"), [&](View request) -> std::vector<Piece> {
      if (request[1] != 3) return {};
      const Bytes reply = RegistersReply(request, 1000);
      if (AddressOf(request) != 999) return {{0ms, reply}};
      return {{0ms, Bytes(reply.begin(), reply.begin() + 100)}};
    });
    ASSERT_TRUE(slave.connected());
    ASSERT_TRUE(Eventually([&] { return client.Holding(kUnit, 5, 1).ok(); }));
    Send(cut, ReadRequest(1, kUnit, 999, 120));
    Send(cut, WriteRequest(2, kUnit, 8, 2));
    ASSERT_TRUE(Eventually([&] { return slave.heard().size() > 1; }));
  }
  EXPECT_TRUE(EventuallyLogged(*daemon, "line drive: port down: "));
  EXPECT_EQ(client.Holding(kUnit, 5, 1).exception, kNotAnswering);
  const ScriptedSlave back(LinkOf("drive"), [&](View request) -> std::vector<Piece> {
    return {{0ms, RegistersReply(request, 7000)}};
  });
  ASSERT_TRUE(Eventually([&] { return client.Holding(kUnit, 5, 1).ok(); }));
  EXPECT_EQ(client.Holding(kUnit, 999, 120).values, Values(7000, 999, 120));
  for (const Bytes& request : back.heard()) EXPECT_EQ(request[1], 3) << "a write was sent late";
  for (int i = 0; i < 2; ++i) EXPECT_EQ(ExceptionIn(Receive(cut).value()), kNotAnswering);
}

TEST_F(BadSlave, ARestartedTwinIsServedAgain) {
  const auto start = [&] {
    return Start({"simulate", "--profile", "mitsubishi-fr-d700", "--address", "20", "--pty",
                  LinkOf("drive")});
  };
  auto twin = start();
  const auto daemon = StartGateway(OneLine());
  ModbusClient client(port());
  ASSERT_TRUE(Eventually([&] { return client.Holding(kUnit, 13, 1).ok(); }));
  EXPECT_EQ(client.WriteRegister(kUnit, 13, 1234), kNoException);
  EXPECT_EQ(client.Holding(kUnit, 13, 1).values[0], 1234);
  RawClient asking(port());
  for (std::uint16_t i = 1; i <= 8; ++i) {
    Send(asking, ReadRequest(i, kUnit, static_cast<std::uint16_t>(995 + i), 120));
  }
  twin->Signal(SIGKILL);
  twin->WaitForEnd();
  for (int i = 0; i < 8; ++i) ASSERT_TRUE(Receive(asking)) << "every request has its answer";
  EXPECT_TRUE(Eventually([&] { return client.Holding(kUnit, 13, 1).exception == kNotAnswering; }));
  twin = start();
  ASSERT_TRUE(Eventually([&] { return client.Holding(kUnit, 13, 1).ok(); }));
  EXPECT_EQ(client.Holding(kUnit, 13, 1).values[0], 2500) << "a new twin knows nothing";
  EXPECT_TRUE(daemon->Running());
}

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::Each;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr std::uint16_t kCount = 120;
constexpr std::uint8_t kAfter = 60;
constexpr std::size_t kFrame = 7 + 2 * kCount + 2;

class StalledServer {
 public:
  StalledServer() : listening_(::socket(AF_INET, SOCK_STREAM, 0)) {
    const int small = 1;  // the kernel's minimum: a buffer of about 1 KiB
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

  int Accept() const {
    return IsReady(listening_, kPatience) ? ::accept(listening_, nullptr, nullptr) : -1;
  }
  static bool IsReady(int descriptor, Duration limit) {
    pollfd waited = {descriptor, POLLIN, 0};
    return ::poll(&waited, 1, static_cast<int>(limit / 1ms)) == 1;
  }
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

TEST_F(Stall, OfASerialServerDeliversNoAbandonedRequest) {
  const StalledServer server;
  const auto daemon = StartGateway(
      Yaml({"{ units: 1-60, line: drive, deadline: 5s }"},
           "  - { name: drive, port: \"tcp://127.0.0.1:" + std::to_string(server.port()) +
               "\", protocol: modbus_rtu, timing: { reply: 200ms } }\n"));
  RawClient client(port());
  const auto lost = [&] {
    return daemon->Errors().find("takes no data, so the gateway gives up a request") !=
           std::string::npos;
  };
  // Sends writes until the kernel's buffer is full. Each write is for another slave, because a
  // silent slave gets no second request.
  std::uint8_t last = 0;
  while (!lost() && last < kAfter - 1) {
    Send(client, Write(++last));
    EXPECT_NE(ExceptionIn(Receive(client).value()), 0);
  }
  ASSERT_TRUE(Eventually(lost)) << daemon->Errors();

  const std::vector<int> units = UnitsIn(StalledServer::ReadAll(server.Accept(), 1 << 20));
  EXPECT_THAT(units, Contains(1)) << "the server's own kernel has it; out of reach";
  EXPECT_THAT(units, Not(Contains(last)));

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
