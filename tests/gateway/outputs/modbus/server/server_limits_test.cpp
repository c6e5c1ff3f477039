// Clients that are too many, not allowed, silent, or that never read their answers.
// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include "tests/gateway/outputs/modbus/server/captured_log.h"
#include "tests/gateway/outputs/modbus/server/server_fixture.h"

namespace baudgate::modbus {
namespace {

constexpr const char* kReadZero = "03 00 00 00 01";
constexpr const char* kAnswer = "03 02 FF FE";

TEST_F(ServerTest, TwoHundredAndFiftySixClientsAreServedAndTheNextIsRefused) {
  StartServer();
  std::vector<RawClient> clients;
  for (int i = 0; i < 256; ++i) {
    clients.push_back(Connect());
    ASSERT_EQ(Ask(clients.back(), 1, kReadZero), kAnswer) << "client " << i;
  }
  EXPECT_TRUE(Connect().IsClosed());
  EXPECT_EQ(server_->counters().clients, 256U);
  EXPECT_EQ(server_->counters().refused, 1U);
  EXPECT_EQ(Ask(clients.front(), 1, kReadZero), kAnswer);
}

TEST_F(ServerTest, WithFewFileDescriptorsEveryListenerLetsInItsShare) {
  config_.modbus.listen.resize(3, listener());
  config_.modbus.listen[0].max_clients = 8;
  config_.modbus.listen[1].max_clients = 4;
  config_.modbus.listen[2].max_clients = 1;
  ModbusLimits limits;
  limits.client_share = 0.25;
  StartServer(limits);
  std::vector<RawClient> clients;
  const std::size_t expected[] = {2, 1, 1};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t n = 0; n < expected[i]; ++n) {
      clients.emplace_back(server_->port(i));
      EXPECT_EQ(Ask(clients.back(), 1, kReadZero), kAnswer);
    }
    EXPECT_TRUE(RawClient(server_->port(i)).IsClosed());
  }
}

TEST_F(ServerTest, AClientThatLeavesMakesRoom) {
  listener().max_clients = 1;
  StartServer();
  RawClient first = Connect();
  ASSERT_EQ(Ask(first, 1, kReadZero), kAnswer);
  first.Send(ParseHex("00 01 12 34").value());
  ASSERT_TRUE(first.IsClosed());
  EXPECT_EQ(Ask(Connect(), 1, kReadZero), kAnswer);
}

TEST_F(ServerTest, OnlyTheAllowListMayConnect) {
  config_.modbus.listen.resize(2, listener());
  config::Network other{"10.0.0.0/8", {}, 104};
  other.bytes[10] = other.bytes[11] = 0xFF;
  other.bytes[12] = 10;
  config::Network loopback{"127.0.0.0/8", other.bytes, 104};
  loopback.bytes[12] = 127;
  config_.modbus.listen[0].allow = {other};
  config_.modbus.listen[1].allow = {other, loopback};
  StartServer();
  EXPECT_TRUE(RawClient(server_->port(0)).IsClosed());
  EXPECT_EQ(Ask(RawClient(server_->port(1)), 1, kReadZero), kAnswer);
  EXPECT_EQ(server_->counters().refused, 1U);
}

TEST_F(ServerTest, ClientsThatAreRefusedOrMalformedFillNoLog) {
  listener().max_clients = 1;
  StartServer();
  CapturedLog log;
  for (int i = 0; i < 5; ++i) {
    const RawClient first = Connect();
    ASSERT_EQ(Ask(first, 1, kReadZero), kAnswer);
    EXPECT_TRUE(Connect().IsClosed());
    first.Send(ParseHex("00 01 12 34").value());
    ASSERT_TRUE(first.IsClosed());
  }
  EXPECT_EQ(server_->counters().refused, 5U);
  EXPECT_EQ(server_->counters().malformed, 5U);
  // Earlier tests may have written them already.
  EXPECT_LE(log.CountLines("modbus: client 127.0.0.1:"), 2);
}

TEST_F(ServerTest, ASilentClientIsClosedAfterTheIdleTimeout) {
  listener().idle_timeout = 20ms;
  StartServer();
  EXPECT_TRUE(Connect().IsClosed());
  EXPECT_EQ(server_->counters().idle, 1U);
}

TEST_F(ServerTest, HalfAFrameDoesNotKeepAClientAlive) {
  listener().idle_timeout = 20ms;
  StartServer();
  const RawClient client = Connect();
  client.Send(View(Frame(1, kReadZero)).first(9));
  EXPECT_TRUE(client.IsClosed());
  EXPECT_EQ(server_->counters().malformed, 0U);
}

TEST_F(ServerTest, WithoutFileDescriptorsItAcceptsAgainLater) {
  StartServer();
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &before), 0);
  const int for_client = ::open("/dev/null", O_RDONLY);
  const int for_server = ::open("/dev/null", O_RDONLY);
  rlimit none_left = before;
  none_left.rlim_cur = static_cast<rlim_t>(for_server);
  ::close(for_server);
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &none_left), 0);
  ::close(for_client);
  const RawClient client = Connect();
  while (client.connected() && server_->counters().accept_errors == 0) std::this_thread::yield();
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &before), 0);
  EXPECT_EQ(Ask(client, 1, kReadZero), kAnswer);
}

/// Sends requests until the server stops taking them because its answers have nowhere to go.
void Flood(const RawClient& client, const Bytes& request, const std::function<bool()>& closed) {
  Bytes many;
  for (int i = 0; i < 100; ++i) Append(many, View(request));
  while (!closed()) client.SendSome(many);
}

TEST_F(ServerTest, AClientThatNeverReadsIsClosedAndDelaysNobody) {
  StartServer({.write_deadline = 5s, .stall = 40ms});
  const RawClient hostile(server_->port(), 4096);
  ASSERT_TRUE(hostile.connected());
  const RawClient other = Connect();
  std::size_t answered = 0;
  Flood(hostile, Frame(1, "03 23 28 00 10"), [&] {
    EXPECT_EQ(Ask(other, 1, kReadZero), kAnswer);
    ++answered;
    return server_->counters().stalled == 1;
  });
  EXPECT_GT(answered, 1U);
  EXPECT_EQ(Ask(other, 1, kReadZero), kAnswer);
}

TEST_F(ServerTest, ASlowReaderGetsEveryAnswer) {
  StartServer();
  const RawClient client(server_->port(), 4096);
  constexpr std::uint16_t kRequests = 20000;
  std::thread sender([&] {
    for (std::uint16_t i = 0; i < kRequests; ++i) client.Send(Frame(1, kReadZero, i));
  });
  std::size_t wrong = 0;
  for (std::uint16_t i = 0; i < kRequests; ++i) {
    const std::string expected = HexByte(static_cast<std::uint8_t>(i >> 8)) + " " +
                                 HexByte(static_cast<std::uint8_t>(i)) +
                                 " 00 00 00 05 01 03 02 FF FE";
    if (ToHex(client.ReceiveFrame()) != expected) ++wrong;
  }
  sender.join();
  EXPECT_EQ(wrong, 0U);
}

}  // namespace
}  // namespace baudgate::modbus
