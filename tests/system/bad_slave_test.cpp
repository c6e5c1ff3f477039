// Slaves behind a route that are silent, late, taken for each other or gone: what masters see of
// them, and that it passes when they are well again.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <signal.h>

#include <algorithm>
#include <atomic>
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

  /// Values of `count` registers from `address` as RegistersReply has them.
  static std::vector<std::uint16_t> Values(std::uint16_t base, int address, int count) {
    std::vector<std::uint16_t> values(static_cast<std::size_t>(count));
    std::iota(values.begin(), values.end(), static_cast<std::uint16_t>(base + address));
    return values;
  }
};

TEST_F(BadSlave, ThatIsMutedIsAnException) {
  std::atomic<bool> muted = true;
  const ScriptedSlave slave(LinkOf("drive"), [&](View request) -> std::vector<Piece> {
    if (muted) return {};
    return {{0ms, RegistersReply(request, 1000)}};
  });
  ASSERT_TRUE(slave.connected());
  const auto daemon = StartGateway(OneLine());
  ModbusClient client(port());
  EXPECT_EQ(client.Holding(kUnit, 5, 1).exception, kNotAnswering);
  EXPECT_EQ(client.WriteRegister(kUnit, 5, 1), kNotAnswering);
  muted = false;
  EXPECT_TRUE(Eventually([&] { return client.Holding(kUnit, 6, 2).ok(); })) << "it is back";
  EXPECT_THAT(client.Holding(kUnit, 7, 2).values, ElementsAre(1007, 1008));
}

/// The reply to register 10 comes when it has been given up, and looks like one to register 11.
TEST_F(BadSlave, ThatIsLateDoesNotAnswerTheNextRequest) {
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

TEST_F(BadSlave, ThatIsAnotherOneIsNotBelieved) {
  std::atomic<bool> wrong = true;
  const ScriptedSlave slave(LinkOf("drive"), [&](View request) -> std::vector<Piece> {
    Bytes asked(request.begin(), request.end());
    if (wrong && request[0] == kUnit) asked[0] = 21;
    return {{0ms, RegistersReply(asked, 1000)}};
  });
  ASSERT_TRUE(slave.connected());
  const auto daemon = StartGateway(OneLine());
  ModbusClient client(port());
  EXPECT_EQ(client.Holding(kUnit, 5, 1).exception, kNotAnswering);
  EXPECT_TRUE(Eventually([&] { return client.Holding(21, 5, 1).ok(); })) << "the right one";
  EXPECT_EQ(client.Holding(21, 5, 2).values, Values(1000, 5, 2));
  wrong = false;
  EXPECT_TRUE(Eventually([&] { return client.Holding(kUnit, 6, 1).ok(); }));
  EXPECT_EQ(client.Holding(kUnit, 6, 3).values, Values(1000, 6, 3));
}

TEST_F(BadSlave, ThatSpeaksInPiecesIsHeardOut) {
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

/// The reply to a block breaks off and the port goes while a write waits. What comes back has other
/// values.
TEST_F(BadSlave, ThatVanishesInABlockReturnsWithoutAnythingStale) {
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
    // The pty goes with the slave.
  }
  EXPECT_TRUE(EventuallyLogged(*daemon, "line drive: down: "));
  EXPECT_EQ(client.Holding(kUnit, 5, 1).exception, kNotAnswering);
  const ScriptedSlave back(LinkOf("drive"), [&](View request) -> std::vector<Piece> {
    return {{0ms, RegistersReply(request, 7000)}};
  });
  ASSERT_TRUE(Eventually([&] { return client.Holding(kUnit, 5, 1).ok(); }));
  EXPECT_EQ(client.Holding(kUnit, 999, 120).values, Values(7000, 999, 120));
  for (const Bytes& request : back.heard()) EXPECT_EQ(request[1], 3) << "a write was sent late";
  for (int i = 0; i < 2; ++i) EXPECT_EQ(ExceptionIn(Receive(cut).value()), kNotAnswering);
}

TEST_F(BadSlave, TwinThatIsKilledAndStartedAgainIsAskedAgain) {
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

}  // namespace
}  // namespace baudgate::system_test
