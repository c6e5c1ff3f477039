// Transparent routes with many requests and many clients at once: what waits, what is answered, and
// what is refused.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <atomic>
#include <set>
#include <thread>
#include <vector>

#include "tests/system/messages.h"
#include "tests/system/routes_fixture.h"

namespace baudgate::system_test {
namespace {

using ::testing::ElementsAre;

TEST_F(Routes, ThatAreFullSaySo) {
  const ScriptedSlave muted(LinkOf("drive"), Nothing);
  const auto daemon = StartGateway(Yaml({"{ units: 20, line: drive, deadline: 1500ms }"},
                                        BareLine("drive", "timing: { reply: 500ms }")));
  RawClient greedy(port());
  ASSERT_TRUE(greedy.connected());
  constexpr std::uint16_t kRequests = 60;
  for (std::uint16_t i = 1; i <= kRequests; ++i) Send(greedy, WriteRequest(i, kUnit, i, i));
  std::set<std::uint16_t> answered;
  int busy = 0;
  int silent = 0;
  for (int i = 0; i < kRequests; ++i) {
    const auto message = Receive(greedy);
    ASSERT_TRUE(message) << "answer " << i;
    EXPECT_TRUE(answered.insert(message->transaction).second) << message->transaction;
    busy += ExceptionIn(*message) == kBusy ? 1 : 0;
    silent += ExceptionIn(*message) == kNotAnswering ? 1 : 0;
  }
  EXPECT_GT(busy, 0);
  EXPECT_GT(silent, 0);
  EXPECT_EQ(busy + silent, kRequests);
  const Json route = Route("20");
  EXPECT_EQ(route["requests"], kRequests);
  EXPECT_EQ(route["busy"], busy);
  EXPECT_EQ(route["no_reply"].get<int>() + route["expired"].get<int>(), silent);
  for (const Bytes& request : muted.heard()) EXPECT_LE(request[3], kRequests - busy);
}

TEST_F(Routes, ThatAreFullForEverybodySaySoToEverybody) {
  const ScriptedSlave muted(LinkOf("drive"), Nothing);
  const auto daemon = StartGateway(Yaml({"{ units: 20, line: drive, deadline: 2s }"},
                                        BareLine("drive", "timing: { reply: 500ms }")));
  constexpr std::uint16_t kEach = 32;  // each client may have so many
  constexpr int kClients = 72;         // but the line takes those of 64
  std::vector<RawClient> clients;
  while (std::ssize(clients) < kClients) {
    const RawClient& client = clients.emplace_back(port());
    for (std::uint16_t i = 0; i < kEach; ++i) Send(client, WriteRequest(i, kUnit, i, i));
  }
  int busy = 0;
  int silent = 0;
  for (auto& client : clients) {
    for (std::uint16_t i = 0; i < kEach; ++i) {
      const auto message = Receive(client);
      ASSERT_TRUE(message);
      busy += ExceptionIn(*message) == kBusy ? 1 : 0;
      silent += ExceptionIn(*message) == kNotAnswering ? 1 : 0;
    }
  }
  EXPECT_GT(busy, 0) << "the line takes fewer";
  EXPECT_EQ(busy + silent, kClients * kEach);
  EXPECT_EQ(Route("20")["busy"], busy);
}

TEST_F(Routes, ThatAreFullStillTakeAStop) {
  const ScriptedSlave muted(LinkOf("drive"), Nothing);
  const auto daemon = StartGateway(Yaml({"{ units: 20, line: drive, deadline: 3s }"},
                                        BareLine("drive", "timing: { reply: 500ms }")));
  constexpr std::uint16_t kEach = 32;
  constexpr int kClients = 72;
  std::vector<RawClient> clients;
  while (std::ssize(clients) < kClients) {
    const RawClient& client = clients.emplace_back(port());
    for (std::uint16_t i = 0; i < kEach; ++i) Send(client, {i, kUnit, {0x64, 0x00}});
  }
  ASSERT_TRUE(Receive(clients.back())) << "its last were refused";
  RawClient hand(port());
  Send(hand, WriteRequest(1, kUnit, 8, 0));
  Send(hand, {2, kUnit, {0x64, 0x00}});
  const auto refused = Receive(hand);
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->transaction, 2);
  EXPECT_EQ(ExceptionIn(*refused), kBusy) << "it was full";
  const auto stop = Receive(hand);
  ASSERT_TRUE(stop);
  EXPECT_EQ(ExceptionIn(*stop), kNotAnswering);
}

TEST_F(Routes, KeepTheNumbersOfRequestsThatWaitTogether) {
  const ScriptedSlave slave(LinkOf("drive"), Answer);
  const auto daemon = StartGateway(
      Yaml({"{ units: 20-22, line: drive }"}, BareLine("drive", "serial: 115200 8E1")));
  RawClient client(port());
  constexpr std::uint16_t kRequests = 30;
  for (std::uint16_t i = 0; i < kRequests; ++i) {
    const auto unit = static_cast<std::uint8_t>(kUnit + i % 3);
    Send(client, ReadRequest(static_cast<std::uint16_t>(0xFFF0 + i), unit, i, i % 2 == 0 ? 1 : 2));
  }
  std::set<std::uint16_t> answered;
  for (int i = 0; i < kRequests; ++i) {
    const auto message = Receive(client);
    ASSERT_TRUE(message) << "answer " << i;
    const auto number = static_cast<std::uint16_t>(message->transaction - 0xFFF0);
    EXPECT_TRUE(answered.insert(number).second) << number;
    EXPECT_EQ(message->unit, kUnit + number % 3);
    EXPECT_EQ(ExceptionIn(*message), 0) << "request " << number;
    if (number % 2 == 0) {
      EXPECT_THAT(RegistersIn(*message), ElementsAre(1000 + number));
    } else {
      EXPECT_THAT(RegistersIn(*message), ElementsAre(1000 + number, 1001 + number));
    }
  }
}

TEST_F(Routes, ServeSixtyFourClientsThatConnectForEachMessage) {
  const ScriptedSlave slave(LinkOf("drive"), Answer);
  const auto daemon =
      StartGateway(Yaml({"{ units: 20, line: drive, deadline: 10s }"},
                        BareLine("drive", "serial: 115200 8E1, timing: { quiet: 0ms }")));
  constexpr std::uint16_t kClients = 64;
  constexpr std::uint16_t kRounds = 3;
  std::atomic<int> good = 0;
  std::vector<std::thread> clients;
  for (std::uint16_t i = 0; i < kClients; ++i) {
    clients.emplace_back([&, i] {
      for (std::uint16_t round = 0; round < kRounds; ++round) {
        RawClient client(port());
        const auto address = static_cast<std::uint16_t>(i + 100 * round);
        Send(client, ReadRequest(address, kUnit, address));
        const auto message = Receive(client);
        if (!message || message->transaction != address) continue;
        good += RegistersIn(*message) == std::vector{static_cast<std::uint16_t>(1000 + address)};
      }
    });
  }
  for (std::thread& client : clients) client.join();
  EXPECT_EQ(good, kClients * kRounds);
  EXPECT_EQ(Route("20")["ok"], kClients * kRounds);
  EXPECT_EQ(slave.heard().size(), kClients * kRounds);
}

}  // namespace
}  // namespace baudgate::system_test
