// Tests of reads, writes, exceptions and framing through a real socket.
// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <unistd.h>

#include "gateway/outputs/modbus/server/modbus_server.h"
#include "tests/gateway/outputs/modbus/server/captured_log.h"
#include "tests/gateway/outputs/modbus/server/server_fixture.h"

namespace baudgate::modbus {
namespace {

TEST_F(ServerTest, RegistersAndBitsAreReadFromBothTables) {
  StartServer();
  const RawClient client = Connect();
  EXPECT_EQ(Ask(client, 1, "03 00 00 00 03"), "03 06 FF FE 47 F1 20 00");
  EXPECT_EQ(Ask(client, 1, "04 00 00 00 03"), "04 06 FF FE 47 F1 20 00");
  EXPECT_EQ(Ask(client, 1, "01 00 00 00 02"), "01 01 01");
  EXPECT_EQ(Ask(client, 1, "02 00 00 00 02"), "02 01 01");
  EXPECT_EQ(Ask(client, 1, "03 4E 20 00 04"), "03 08 00 C0 00 C0 00 C0 00 20");
  EXPECT_EQ(Ask(client, 1, "02 4E 20 00 02"), "02 01 03");
  EXPECT_EQ(Ask(client, 1, "04 9C 43 00 01"), "04 02 FF FF");
}

TEST_F(ServerTest, EveryExceptionIsAnsweredAndCounted) {
  listener().permit = config::Permit::all;
  StartServer();
  const RawClient client = Connect();
  EXPECT_EQ(Ask(client, 1, "07"), "87 01");
  EXPECT_EQ(Ask(client, 1, "17 00 00 00 01 00 00 00 01 02 00 00"), "97 01");
  EXPECT_EQ(Ask(client, 1, "03 00 04 00 01"), "83 02");
  EXPECT_EQ(Ask(client, 1, "06 00 03 00 00"), "86 02");
  EXPECT_EQ(Ask(client, 1, "03 00 00 00 00"), "83 03");
  EXPECT_EQ(Ask(client, 1, "03 00 00 00 7E"), "83 03");
  EXPECT_EQ(Ask(client, 1, "03 00 00 00 02"), "83 03");
  EXPECT_EQ(Ask(client, 2, "03 00 00 00 01"), "83 0A");
  EXPECT_EQ(Ask(client, 2, "07"), "87 0A");
  EXPECT_EQ(Ask(client, 1, "03 00 03 00 01"), "83 0B");
  const ModbusCounters counters = server_->counters();
  EXPECT_EQ(counters.requests, 10U);
  EXPECT_EQ(counters.exceptions, 10U);
}

TEST_F(ServerTest, WritingCanBeDeniedPerListener) {
  config_.modbus.listen.push_back(listener());
  listener().permit = config::Permit::read;
  sink_.answer = WriteEnd::ok;
  StartServer();
  const RawClient reader(server_->port(0));
  EXPECT_EQ(Ask(reader, 1, "06 00 00 00 01"), "86 01");
  EXPECT_EQ(Ask(reader, 1, "05 00 00 FF 00"), "85 01");
  EXPECT_EQ(Ask(reader, 1, "0F 00 00 00 01 01 01"), "8F 01");
  EXPECT_EQ(Ask(reader, 1, "10 00 00 00 01 02 00 01"), "90 01");
  EXPECT_EQ(Ask(reader, 1, "03 00 00 00 01"), "03 02 FF FE");
  const RawClient writer(server_->port(1));
  EXPECT_EQ(Ask(writer, 1, "06 00 00 00 01"), "06 00 00 00 01");
}

TEST_F(ServerTest, StatusOfDeviceAndGatewayIsServed) {
  StartServer();
  store_->UpdateStatus(0,
                       [](bus::DeviceStatus& status) { status.state = bus::DeviceState::online; });
  const RawClient client = Connect();
  EXPECT_EQ(Ask(client, 1, "04 23 28 00 02"), "04 04 00 01 00 00");
  const char* kGateway = "03 10 00 64 00 01 00 00 00 5A 00 01 00 01 00 01 00 01";
  EXPECT_EQ(Ask(client, 255, "03 23 28 00 08"), kGateway);
  EXPECT_EQ(Ask(client, 0, "03 23 28 00 08"), kGateway);
  EXPECT_EQ(Ask(client, 255, "03 00 00 00 01"), "83 02");
  EXPECT_EQ(Ask(client, 0, "01 00 00 00 01"), "81 02");
  EXPECT_EQ(Ask(client, 0, "06 23 28 00 01"), "86 02");
}

TEST_F(ServerTest, TransactionAndUnitAreEchoed) {
  StartServer();
  const RawClient client = Connect();
  client.Send(Frame(1, "03 00 00 00 01", 0xBEEF));
  EXPECT_EQ(ToHex(client.ReceiveFrame()), "BE EF 00 00 00 05 01 03 02 FF FE");
}

TEST_F(ServerTest, ARequestInPiecesIsAnswered) {
  StartServer();
  const RawClient client = Connect();
  const Bytes request = Frame(1, "03 00 00 00 01");
  for (std::size_t cut = 1; cut < request.size(); ++cut) {
    client.Send(View(request).first(cut));
    client.Send(View(request).subspan(cut));
    ASSERT_EQ(ToHex(client.ReceiveFrame()), "12 34 00 00 00 05 01 03 02 FF FE") << "cut at " << cut;
  }
  for (const std::uint8_t byte : request) client.Send(View(&byte, 1));
  EXPECT_EQ(ToHex(client.ReceiveFrame()), "12 34 00 00 00 05 01 03 02 FF FE");
}

TEST_F(ServerTest, PipelinedRequestsAreAllAnsweredInOrder) {
  StartServer();
  const RawClient client = Connect();
  constexpr std::uint16_t kRequests = 300;
  Bytes stream;
  for (std::uint16_t i = 0; i < kRequests; ++i) {
    Append(stream, View(Frame(1, i % 3 == 0 ? "07" : "03 00 00 00 01", i)));
  }
  ASSERT_EQ(client.Send(stream), stream.size());
  for (std::uint16_t i = 0; i < kRequests; ++i) {
    const std::string tail = i % 3 == 0 ? " 00 00 00 03 01 87 01" : " 00 00 00 05 01 03 02 FF FE";
    const auto high = static_cast<std::uint8_t>(i >> 8);
    const auto low = static_cast<std::uint8_t>(i);
    ASSERT_EQ(ToHex(client.ReceiveFrame()), HexByte(high) + " " + HexByte(low) + tail);
  }
}

TEST_F(ServerTest, GarbageClosesTheConnectionAfterTheGoodFrames) {
  StartServer();
  for (const char* garbage : {"00 01 12 34", "00 01 00 00 00 00", "00 01 00 00 00 01 01",
                              "00 01 00 00 00 FF", "47 45 54 20 2F 20 48 54 54 50"}) {
    const RawClient client = Connect();
    ASSERT_EQ(Ask(client, 1, "03 00 00 00 01"), "03 02 FF FE");
    client.Send(ParseHex(garbage).value());
    EXPECT_TRUE(client.IsClosed()) << garbage;
  }
  EXPECT_EQ(Ask(Connect(), 1, "03 00 00 00 01"), "03 02 FF FE");
  EXPECT_EQ(server_->counters().malformed, 5U);
}

TEST_F(ServerTest, APortInUseIsAClearError) {
  StartServer();
  config::Config second = config_;
  second.modbus.listen.resize(2, second.modbus.listen[0]);
  second.modbus.listen[1].port = server_->port();
  asio::io_context io;
  ModbusServer server(second, *store_, sink_, {});
  const Status status = server.Listen(io);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().find("127.0.0.1:" + std::to_string(server_->port()) +
                                ": address already in use; "),
            0U)
      << status.error();
  EXPECT_EQ(server.port(0), 0) << "all ports or none";
}

TEST_F(ServerTest, AnUnknownAddressIsAClearError) {
  listener().host = "192.0.2.1";
  store_.emplace(config_);
  ModbusServer server(config_, *store_, sink_, {});
  const Status status = server.Listen(io_);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error(), "192.0.2.1:0: this machine has no such address; correct modbus.listen");
}

/// Runs in a separate process, because it overwrites descriptor 3.
TEST_F(ServerTest, ARemovedAddressOfTheMachineIsNamed) {
  const auto trouble = [this] {
    asio::io_context io;
    asio::ip::tcp::acceptor gone(io, asio::ip::tcp::v4());
    // Binds to an address that the machine does not have, as if the address had been removed.
    gone.set_option(asio::detail::socket_option::boolean<IPPROTO_IP, IP_FREEBIND>(true));
    gone.bind({asio::ip::make_address("192.0.2.9"), 0});
    gone.listen();
    listener().host = "192.0.2.9";
    listener().port = gone.local_endpoint().port();
    ::dup2(::fcntl(gone.native_handle(), F_DUPFD, 100), 3);
    ::setenv("LISTEN_PID", std::to_string(::getpid()).c_str(), 1);
    ::setenv("LISTEN_FDS", "1", 1);
    store_.emplace(config_);
    ModbusServer server(config_, *store_, sink_, {});
    if (!server.Listen(io)) return std::string("it does not listen");
    const auto closed = server.Traffic().closed;
    return closed.size() == 1 && closed[0].is_open ? closed[0].why : "it is not named";
  };
  EXPECT_EXIT(
      {
        std::fputs(trouble().c_str(), stderr);
        std::_Exit(0);
      },
      ::testing::ExitedWithCode(0), "this machine does not have the address 192.0.2.9 now");
}

TEST_F(ServerTest, StopClosesClientsAndPorts) {
  StartServer();
  const std::uint16_t port = server_->port();
  const RawClient client = Connect();
  ASSERT_EQ(Ask(client, 1, "03 00 00 00 01"), "03 02 FF FE");
  StopServer();
  EXPECT_TRUE(client.IsClosed());
  EXPECT_FALSE(RawClient(port).connected());
}

TEST_F(ServerTest, ConfirmedWritesAreEchoed) {
  sink_.answer = WriteEnd::ok;
  StartServer();
  const RawClient client = Connect();
  EXPECT_EQ(Ask(client, 1, "06 00 00 00 2A"), "06 00 00 00 2A");
  EXPECT_EQ(Ask(client, 1, "10 00 01 00 02 04 47 F1 20 00"), "10 00 01 00 02");
  EXPECT_EQ(Ask(client, 1, "05 00 00 FF 00"), "05 00 00 FF 00");
  EXPECT_EQ(Ask(client, 1, "05 00 00 00 00"), "05 00 00 00 00");
  EXPECT_EQ(Ask(client, 1, "0F 00 00 00 01 01 01"), "0F 00 00 00 01");
  const bus::WriteCommand command = sink_.Wait(1);
  EXPECT_EQ(command.device, 0U);
  ASSERT_EQ(command.writes().size(), 1U);
  EXPECT_EQ(command.writes()[0].point, 1U);
  EXPECT_EQ(command.writes()[0].raw, Value(123456.0));
  EXPECT_EQ(Ask(client, 1, "03 00 00 00 01"), "03 02 FF FE") << "only a reading changes the store";
}

struct WriteEnding {
  WriteEnd end;
  const char* answer;
  bool unfit = false;
};

class WriteEndings : public ServerTest, public testing::WithParamInterface<WriteEnding> {};

TEST_P(WriteEndings, AreAnsweredByTheContract) {
  sink_.answer = GetParam().end;
  sink_.unfit = GetParam().unfit;
  StartServer();
  EXPECT_EQ(Ask(Connect(), 1, "06 00 00 00 01"), GetParam().answer);
}

INSTANTIATE_TEST_SUITE_P(
    All, WriteEndings,
    testing::Values(WriteEnding{WriteEnd::refused, "86 04"},
                    WriteEnding{WriteEnd::refused, "86 03", true},
                    WriteEnding{WriteEnd::differs, "86 04"}, WriteEnding{WriteEnd::denied, "86 04"},
                    WriteEnding{WriteEnd::busy, "86 06"}, WriteEnding{WriteEnd::unknown, "86 0B"},
                    WriteEnding{WriteEnd::not_sent, "86 0B"}),
    [](const auto& info) {
      return std::string(Name(info.param.end)) + (info.param.unfit ? "_unfit" : "");
    });

TEST_F(ServerTest, AFullQueueIsAnsweredWithBusy) {
  sink_.full = true;
  StartServer();
  EXPECT_EQ(Ask(Connect(), 1, "06 00 00 00 01"), "86 06");
}

TEST_F(ServerTest, RefusedWritesNeverReachTheSink) {
  sink_.answer = WriteEnd::ok;
  StartServer();
  const RawClient client = Connect();
  EXPECT_EQ(Ask(client, 1, "06 00 03 00 01"), "86 02");
  EXPECT_EQ(Ask(client, 1, "06 00 01 00 01"), "86 03");
  EXPECT_EQ(Ask(client, 1, "05 00 01 FF 00"), "85 02");
  EXPECT_EQ(Ask(client, 1, "10 00 00 00 02 04 00 00"), "90 03") << "data cut short";
  EXPECT_EQ(Ask(client, 1, "06 00 00 00 05"), "06 00 00 00 05");
  EXPECT_EQ(sink_.Wait(0).writes()[0].raw, Value(std::int64_t{5})) << "the first to arrive";
}

TEST_F(ServerTest, LaterRequestsDoNotWaitForAWrite) {
  StartServer();
  const RawClient client = Connect();
  client.Send(Frame(1, "06 00 00 00 01", 1));
  client.Send(Frame(1, "03 00 00 00 01", 2));
  EXPECT_EQ(ToHex(client.ReceiveFrame()), "00 02 00 00 00 05 01 03 02 FF FE");
  sink_.Wait(0).done({});
  EXPECT_EQ(ToHex(client.ReceiveFrame()), "00 01 00 00 00 06 01 06 00 00 00 01");
}

TEST_F(ServerTest, AWriteIsAnsweredOnceAtItsDeadline) {
  StartServer({.write_deadline = 20ms, .stall = 10s});
  const RawClient client = Connect();
  const Instant before = ReadClocks().instant;
  EXPECT_EQ(Ask(client, 1, "06 00 00 00 01"), "86 0B");
  EXPECT_GE(ReadClocks().instant, before + 20ms);
  const bus::WriteCommand command = sink_.Wait(0);
  EXPECT_GE(command.deadline, before + 20ms);
  command.done({});
  EXPECT_EQ(Ask(client, 1, "03 00 00 00 01"), "03 02 FF FE") << "no late answer in between";
}

TEST_F(ServerTest, AClientMayNotFillTheQueue) {
  StartServer();
  const RawClient client = Connect();
  for (std::uint16_t i = 0; i < 33; ++i) client.Send(Frame(1, "06 00 00 00 01", i));
  EXPECT_EQ(ToHex(client.ReceiveFrame()), "00 20 00 00 00 03 01 86 06");
}

TEST_F(ServerTest, TheClientMayHaveLeftWhenTheDeviceConfirms) {
  listener().max_clients = 1;
  StartServer();
  RawClient client = Connect();
  client.Send(Frame(1, "06 00 00 00 01"));
  const bus::WriteCommand command = sink_.Wait(0);
  client.Send(ParseHex("00 01 12 34").value());
  ASSERT_TRUE(client.IsClosed());
  command.done({});
  EXPECT_EQ(Ask(Connect(), 1, "03 00 00 00 01"), "03 02 FF FE");
}

TEST_F(ServerTest, TheServerMayHaveStoppedWhenTheDeviceConfirms) {
  StartServer();
  const RawClient client = Connect();
  client.Send(Frame(1, "06 00 00 00 01"));
  const bus::WriteCommand command = sink_.Wait(0);
  StopServer();
  command.done({});
  EXPECT_TRUE(client.IsClosed());
}

constexpr const char* kReadZero = "03 00 00 00 01";
constexpr const char* kAnswer = "03 02 FF FE";

TEST_F(ServerTest, TheServerAccepts256ClientsAndRefusesTheNext) {
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

TEST(ClosedForRoom, FollowsTheTableInItsHeader) {
  constexpr std::uint64_t kHog = 1;
  constexpr std::uint64_t kOther = 2;
  constexpr std::uint64_t kNew = 3;
  const Instant now = Instant() + 1h;
  const auto at = [now](std::uint64_t host, Duration idle, bool pending = false) {
    return OpenConnection{host, now - idle, pending};
  };
  const auto closed = [now](const std::vector<OpenConnection>& open, std::uint64_t host) {
    return ClosedForRoom(open, host, now);
  };
  EXPECT_EQ(closed({at(kHog, 1s), at(kHog, 3s, true), at(kOther, 1h)}, kNew), 1U)
      << "busy, but the longest idle of a host with two more";
  EXPECT_EQ(closed({at(kHog, 1s), at(kHog, 2s), at(kOther, 1h)}, kOther), 2U) << "its own";
  EXPECT_EQ(closed({at(kHog, 1s), at(kHog, 2s), at(kOther, 9s)}, kOther), std::nullopt);
  EXPECT_EQ(closed({at(kHog, 11s), at(kHog, 12s), at(kOther, 1h)}, kHog), 1U)
      << "its own, never that of a smaller host";
  EXPECT_EQ(closed({at(kHog, 9s), at(kOther, 8s)}, kNew), std::nullopt);
  EXPECT_EQ(closed({at(kHog, 10s), at(kOther, 11s, true)}, kNew), 0U);
}

TEST_F(ServerTest, ASilentHostMakesRoomForAnother) {
  listener().max_clients = 2;
  StartServer();
  const RawClient first = Connect();
  const RawClient second = Connect();
  ASSERT_EQ(Ask(second, 1, kReadZero), kAnswer);
  const RawClient other(server_->port(), "127.0.0.2");
  EXPECT_EQ(Ask(other, 1, kReadZero), kAnswer);
  EXPECT_TRUE(first.IsClosed());
  EXPECT_EQ(Ask(second, 1, kReadZero), kAnswer);
}

TEST_F(ServerTest, EveryListenerGetsAShareOfFewFileDescriptors) {
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

TEST_F(ServerTest, ADisconnectedClientFreesItsPlace) {
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

TEST_F(ServerTest, RefusedAndMalformedClientsDoNotFloodTheLog) {
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
  // The log contains each of the two sentences once in a process, so an earlier test may have
  // caused them.
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

TEST_F(ServerTest, TheServerAcceptsAgainWhenFileDescriptorsAreFree) {
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

void Flood(const RawClient& client, const Bytes& request, const std::function<bool()>& closed) {
  Bytes many;
  for (int i = 0; i < 100; ++i) Append(many, View(request));
  while (!closed()) client.SendSome(many);
}

TEST_F(ServerTest, AClientThatNeverReadsIsClosedAndDelaysNoOther) {
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
