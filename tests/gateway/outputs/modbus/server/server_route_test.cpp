// Tests of transparent routes through real sockets, and of RTU over TCP.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <modbus.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <memory>

#include "tests/gateway/outputs/modbus/service/route_fixture.h"

namespace baudgate::modbus {
namespace {

TEST_F(RouteTest, AListenerServesCachedUnitsAndRoutes) {
  Add(1, 20, 20);
  drive_.answer = Count;
  StartServer();
  const RawClient client = Connect();
  EXPECT_EQ(Ask(client, 20, kRead), "03 02 01 F4");
  EXPECT_EQ(Ask(client, 1, "03 00 00 00 01"), "03 02 FF FE");
  EXPECT_EQ(Ask(client, 20, "03 00 00 00 7D").size(), 2U + 125 * 2 * 3 + 3);
  EXPECT_EQ(Ask(client, 99, kRead), "83 0A");
}

TEST_F(RouteTest, RepliesComeInTheOrderOfCompletion) {
  Add(1, 20, 20);
  StartServer();
  const RawClient client = Connect();
  for (std::uint16_t i = 0; i < 32; ++i) client.Send(Frame(20, kRead, i));
  client.Send(Frame(1, "03 00 00 00 01", 99));
  EXPECT_EQ(ToHex(client.ReceiveFrame()), "00 63 00 00 00 05 01 03 02 FF FE")
      << "cached units do not wait";
  for (std::uint8_t i = 32; i-- > 0;) {
    drive_.Wait(i).done(GoodReply(Bytes{3, 2, 0, i}));
    ASSERT_EQ(ToHex(client.ReceiveFrame()),
              "00 " + HexByte(i) + " 00 00 00 05 14 03 02 00 " + HexByte(i));
  }
}

TEST_F(RouteTest, TheLongestAduPassesBothWaysAtEveryCut) {
  Add(1, 20, 20);
  drive_.answer = [](const bus::RoutedRequest& request) { return GoodReply(request.pdu); };
  StartServer();
  const RawClient client = Connect();
  Bytes pdu(253, 0x5A);
  pdu[0] = 0x10;
  const Bytes frame = AduOf(7, 20, pdu);
  for (std::size_t cut = 1; cut < frame.size(); cut += 7) {
    client.Send(View(frame).first(cut));
    client.Send(View(frame).subspan(cut));
    ASSERT_EQ(ToHex(client.ReceiveFrame()), ToHex(frame));
  }
}

TEST_F(RouteTest, ASilentListenerAnswersTheNextRequest) {
  listener().errors = config::Listener::Errors::silent;
  Add(1, 20, 20);
  drive_.answer = [](const bus::RoutedRequest&) { return Trouble(Outcome::no_reply, "silence"); };
  StartServer();
  const RawClient client = Connect();
  client.Send(Frame(20, kRead, 1));
  client.Send(Frame(99, kRead, 2));
  EXPECT_EQ(Ask(client, 1, "03 00 00 00 01"), "03 02 FF FE");
}

TEST_F(RouteTest, ADisconnectedClientIsForgotten) {
  listener().max_clients = 1;
  Add(1, 20, 20);
  StartServer();
  RawClient client = Connect();
  client.Send(Frame(20, kRead));
  const bus::RoutedRequest request = drive_.Wait(0);
  client.Close();
  EXPECT_EQ(drive_.WaitForgotten(0), request.client);
  request.done(GoodReply("03 02 00 00"));
  EXPECT_EQ(Ask(Connect(), 1, "03 00 00 00 01"), "03 02 FF FE");
  EXPECT_EQ(server_->Traffic().routes[0].dropped, 1U);
}

TEST_F(RouteTest, TheServerMayHaveStoppedWhenTheSlaveAnswers) {
  Add(1, 20, 20);
  StartServer();
  const RawClient client = Connect();
  client.Send(Frame(20, kRead));
  const bus::RoutedRequest request = drive_.Wait(0);
  StopServer();
  request.done(GoodReply("03 02 00 00"));
  EXPECT_TRUE(client.IsClosed());
}

TEST_F(RouteTest, PriorityFollowsTheClientsAddress) {
  config_.modbus.listen.resize(2, listener());
  config::Network loopback{"127.0.0.0/8", {}, 104};
  loopback.bytes[10] = loopback.bytes[11] = 0xFF;
  loopback.bytes[12] = 127;
  config_.modbus.listen[0].clients = {{loopback, config::Priority::high},
                                      {loopback, config::Priority::low}};
  config_.modbus.listen[1].priority = config::Priority::low;
  Add(1, 20, 20);
  drive_.answer = Count;
  StartServer();
  Ask(RawClient(server_->port(0)), 20, kRead);
  Ask(RawClient(server_->port(1)), 20, kRead);
  EXPECT_EQ(drive_.Wait(0).priority, config::Priority::high) << "the first that fits";
  EXPECT_EQ(drive_.Wait(1).priority, config::Priority::low);
}

TEST_F(RouteTest, SixtyFourClientsMayConnectForEveryMessage) {
  constexpr int kClients = 64;
  constexpr int kMessages = 20;
  Add(1, 20, 20);
  drive_.answer = Count;
  StartServer();
  std::atomic<int> good = 0;
  std::vector<std::thread> clients;
  for (int i = 0; i < kClients; ++i) {
    clients.emplace_back([&, i] {
      for (int message = 0; message < kMessages; ++message) {
        const auto at = HexByte(static_cast<std::uint8_t>(i));
        if (Ask(Connect(), 20, "03 00 " + at + " 00 01") == "03 02 00 " + at) ++good;
      }
    });
  }
  for (std::thread& client : clients) client.join();
  EXPECT_EQ(good, kClients * kMessages);
  const RouteStatus route = server_->Traffic().routes[0];
  EXPECT_EQ(route.requests, static_cast<std::uint64_t>(kClients * kMessages));
  EXPECT_EQ(route.ok, route.requests);
  EXPECT_EQ(server_->counters().accepted, route.requests);
}

class LibmodbusRouteTest : public RouteTest {
 protected:
  struct Free {
    void operator()(modbus_t* context) const {
      modbus_close(context);
      modbus_free(context);
    }
  };

  void ConnectLibmodbus(int slave) {
    context_.reset(modbus_new_tcp("127.0.0.1", server_->port()));
    ASSERT_NE(context_, nullptr);
    modbus_set_slave(context_.get(), slave);
    modbus_set_response_timeout(context_.get(), 20, 0);
    ASSERT_EQ(modbus_connect(context_.get()), 0);
  }

  std::unique_ptr<modbus_t, Free> context_;
};

TEST_F(LibmodbusRouteTest, ReadsTheLargestBlockThroughARoute) {
  Add(1, 33, 40).remap = 1;
  drive_.answer = Count;
  StartServer();
  ConnectLibmodbus(34);
  std::array<std::uint16_t, 125> registers{};
  ASSERT_EQ(modbus_read_registers(context_.get(), 999, 125, registers.data()), 125);
  for (std::size_t i = 0; i < registers.size(); ++i) ASSERT_EQ(registers[i], 999 + i);
  EXPECT_EQ(drive_.Wait(0).slave, 2);
}

TEST_F(LibmodbusRouteTest, WritesAndReadsInOneExchange) {
  Add(1, 20, 20);
  drive_.answer = Count;
  StartServer();
  ConnectLibmodbus(20);
  const std::array<std::uint16_t, 2> values = {0xBEEF, 0x0102};
  std::array<std::uint16_t, 3> registers{};
  ASSERT_EQ(modbus_write_and_read_registers(context_.get(), 13, 2, values.data(), 201, 3,
                                            registers.data()),
            3);
  EXPECT_EQ(registers, (std::array<std::uint16_t, 3>{201, 202, 203}));
  EXPECT_EQ(ToHex(drive_.Wait(0).pdu), "17 00 C9 00 03 00 0D 00 02 04 BE EF 01 02");
}

TEST_F(LibmodbusRouteTest, ReceivesEveryExceptionOfGatewayAndSlave) {
  Add(1, 20, 20);
  Add(2, 30, 30);
  pumps_.full = true;
  drive_.answer = [](const bus::RoutedRequest& request) {
    return request.pdu[2] == 0 ? Trouble(Outcome::no_reply, "silence") : SlaveException("83 02");
  };
  StartServer();
  ConnectLibmodbus(20);
  std::uint16_t value = 0;
  EXPECT_EQ(modbus_read_registers(context_.get(), 0, 1, &value), -1);
  EXPECT_EQ(errno, EMBXGTAR);
  EXPECT_EQ(modbus_read_registers(context_.get(), 1, 1, &value), -1);
  EXPECT_EQ(errno, EMBXILADD);
  modbus_set_slave(context_.get(), 30);
  EXPECT_EQ(modbus_read_registers(context_.get(), 0, 1, &value), -1);
  EXPECT_EQ(errno, EMBXSBUSY);
  modbus_set_slave(context_.get(), 77);
  EXPECT_EQ(modbus_read_registers(context_.get(), 0, 1, &value), -1);
  EXPECT_EQ(errno, EMBXGPATH);
}

TEST_F(RouteTest, ARouteReachesARemoteServer) {
  ServerTest::StartServer();
  config::Config config = MakeConfig({});
  config.modbus.listen.resize(1);
  config.modbus.listen[0].port = 0;
  for (const std::uint8_t unit : std::array<std::uint8_t, 2>{50, 60}) {
    config::Route& route = config.modbus.routes.emplace_back();
    route.first = route.last = unit;
    route.remap = 1;
    route.host = "127.0.0.1";
    route.port = server_->port();
    route.deadline = 20s;
  }
  asio::io_context io;
  auto work = asio::make_work_guard(io);
  const bus::PointStore store(config);
  ModbusServer front(config, store, sink_, {});
  ASSERT_TRUE(front.Listen(io).ok());
  std::thread thread([&io] { io.run(); });
  {
    const RawClient client(front.port());
    EXPECT_EQ(Ask(client, 50, "03 00 00 00 03"), "03 06 FF FE 47 F1 20 00");
    EXPECT_EQ(Ask(client, 60, "01 00 00 00 02"), "01 01 01");
    EXPECT_EQ(Ask(client, 60, "03 00 09 00 01"), "83 02");
    EXPECT_EQ(Ask(client, 51, "03 00 00 00 01"), "83 0A");
  }
  EXPECT_EQ(server_->counters().accepted, 1U) << "one connection for both routes";
  io.stop();
  thread.join();
  front.Stop();
  EXPECT_EQ(front.Traffic().routes[0].target,
            "server 127.0.0.1:" + std::to_string(server_->port()));
  EXPECT_EQ(front.Traffic().routes[0].ok, 1U);
  EXPECT_EQ(front.Traffic().routes[1].refused, 1U);
}

class RtuOverTcpTest : public RouteTest {
 protected:
  RtuOverTcpTest() { listener().framing = Framing::rtu; }

  static Bytes Rtu(std::uint8_t slave, const std::string& pdu) {
    return protocols::ModbusRtuProtocol().carrier->wrap(slave, ParseHex(pdu).value());
  }
  static void ExpectReply(const RawClient& client, std::uint8_t slave, const std::string& pdu) {
    const Bytes expected = Rtu(slave, pdu);
    EXPECT_EQ(ToHex(client.Receive(expected.size())), ToHex(expected));
  }
};

TEST_F(RtuOverTcpTest, ServesCachedUnitsRoutesAndExceptions) {
  Add(1, 20, 20);
  drive_.answer = Count;
  sink_.answer = WriteEnd::ok;
  StartServer();
  const RawClient client = Connect();
  client.Send(Rtu(1, "03 00 00 00 03"));
  ExpectReply(client, 1, "03 06 FF FE 47 F1 20 00");
  client.Send(Rtu(20, kRead));
  ExpectReply(client, 20, "03 02 01 F4");
  client.Send(Rtu(1, "06 00 00 00 2A"));
  ExpectReply(client, 1, "06 00 00 00 2A");
  client.Send(Rtu(99, kRead));
  ExpectReply(client, 99, "83 0A");
  client.Send(Rtu(20, "03 00 00 00 7D"));
  EXPECT_EQ(ToHex(client.Receive(255)).size(), 255 * 3U - 1);
}

TEST_F(RtuOverTcpTest, ARequestIsAnsweredAtEveryCut) {
  Add(1, 20, 20);
  drive_.answer = Count;
  StartServer();
  const RawClient client = Connect();
  const Bytes request = Rtu(20, kRead);
  for (std::size_t cut = 1; cut < request.size(); ++cut) {
    client.Send(View(request).first(cut));
    client.Send(View(request).subspan(cut));
    ExpectReply(client, 20, "03 02 01 F4");
  }
}

TEST_F(RtuOverTcpTest, ANewRequestCancelsTheUnansweredRequest) {
  Add(1, 20, 20);
  StartServer();
  const RawClient client = Connect();
  client.Send(Rtu(20, "03 00 C8 00 01"));
  const bus::RoutedRequest first = drive_.Wait(0);
  client.Send(Rtu(20, "03 00 C9 00 01"));
  const bus::RoutedRequest second = drive_.Wait(1);
  EXPECT_EQ(drive_.WaitForgotten(0), first.client);
  first.done(GoodReply("03 02 00 C8"));
  second.done(GoodReply("03 02 00 C9"));
  ExpectReply(client, 20, "03 02 00 C9");
  client.Send(Rtu(1, "03 00 00 00 01"));
  ExpectReply(client, 1, "03 02 FF FE");
  EXPECT_EQ(server_->Traffic().routes[0].dropped, 1U);
}

TEST_F(RtuOverTcpTest, ACancelledWriteIsNeverAnswered) {
  StartServer();
  const RawClient client = Connect();
  client.Send(Rtu(1, "06 00 00 00 2A"));
  const bus::WriteCommand write = sink_.Wait(0);
  client.Send(Rtu(1, "03 00 00 00 01"));
  ExpectReply(client, 1, "03 02 FF FE");
  write.done({});
  client.Send(Rtu(1, "03 00 00 00 03"));
  ExpectReply(client, 1, "03 06 FF FE 47 F1 20 00");
}

TEST_F(RtuOverTcpTest, TheLastOfSeveralRequestsInOnePieceIsAnswered) {
  Add(1, 20, 20);
  StartServer();
  const RawClient client = Connect();
  Bytes together = Rtu(1, "03 00 00 00 01");
  Append(together, View(Rtu(20, "06 00 08 00 02")));
  Append(together, View(Rtu(20, "03 00 02 00 01")));
  client.Send(together);
  const bus::RoutedRequest asked = drive_.Wait(0);
  EXPECT_EQ(ToHex(asked.pdu), "03 00 02 00 01") << "nobody waits for those before";
  asked.done(GoodReply("03 02 00 02"));
  ExpectReply(client, 20, "03 02 00 02");
}

TEST_F(RtuOverTcpTest, NoReplyIsSentDuringTheNextRequest) {
  Add(1, 20, 20);
  StartServer();
  const RawClient client = Connect();
  client.Send(Rtu(20, "03 00 C8 00 01"));
  const bus::RoutedRequest first = drive_.Wait(0);
  const Bytes next = Rtu(1, "03 00 00 00 01");
  client.Send(View(next).first(5));
  first.done(GoodReply("03 02 00 C8"));
  // The server handles bytes in their order, so the answer to `other` shows that it has handled the
  // bytes of `client`.
  const RawClient other = Connect();
  other.Send(Rtu(1, "03 00 00 00 01"));
  ExpectReply(other, 1, "03 02 FF FE");
  client.Send(View(next).subspan(5));
  ExpectReply(client, 1, "03 02 FF FE");
}

TEST_F(RtuOverTcpTest, TrailingNoiseDoesNotSuppressTheReply) {
  Add(1, 20, 20);
  drive_.answer = Count;
  StartServer();
  const RawClient client = Connect();
  Bytes request = Rtu(20, kRead);
  request.push_back(0x14);
  request.push_back(0x03);
  client.Send(request);
  ExpectReply(client, 20, "03 02 01 F4");
}

TEST_F(RtuOverTcpTest, ADamagedRequestIsNeverAnswered) {
  Add(1, 20, 20);
  drive_.answer = Count;
  StartServer();
  const RawClient client = Connect();
  const RawClient other = Connect();
  // The server answers this request only after silence, so it has handled all earlier bytes by
  // then.
  const auto await_silence = [&] {
    Bytes request = Rtu(20, kRead);
    Append(request, View(ParseHex("14 03").value()));
    other.Send(request);
    ExpectReply(other, 20, "03 02 01 F4");
  };
  const Bytes good = Rtu(1, "03 00 00 00 01");
  Bytes damaged = good;
  damaged.back() ^= 1;
  Bytes hidden = ParseHex("47 45 54 20 2F 20 48 54 54 50").value();
  Append(hidden, View(Rtu(1, "06 00 00 00 07")));
  for (const Bytes& noise : {damaged, hidden}) {
    client.Send(noise);
    await_silence();
    client.Send(good);
    ExpectReply(client, 1, "03 02 FF FE");
  }
  EXPECT_EQ(sink_.count(), 0U) << "a frame within noise is nobody's request";
  EXPECT_EQ(server_->counters().exceptions, 0U);
  EXPECT_EQ(server_->counters().malformed, 0U);
}

TEST_F(RtuOverTcpTest, ARequestAfterUnansweredRequestsIsAnswered) {
  listener().errors = config::Listener::Errors::silent;
  listener().broadcast = config::Listener::Broadcast::pass;
  Add(1, 20, 20);
  drive_.answer = [](const bus::RoutedRequest& request) {
    return request.slave == 0 ? GoodReply(Bytes{}) : Trouble(Outcome::no_reply, "silence");
  };
  StartServer();
  const RawClient client = Connect();
  Bytes all = Rtu(99, kRead);
  Append(all, View(Rtu(0, "06 00 08 00 00")));
  Append(all, View(Rtu(20, kRead)));
  Append(all, View(Rtu(1, "03 00 00 00 01")));
  client.Send(all);
  ExpectReply(client, 1, "03 02 FF FE");
  EXPECT_EQ(drive_.Wait(0).slave, 0);
}

TEST_F(RtuOverTcpTest, ARequestOfUnknownLengthEndsWithSilence) {
  Add(1, 20, 20);
  drive_.answer = [](const bus::RoutedRequest& request) { return GoodReply(request.pdu); };
  StartServer();
  const RawClient client = Connect();
  client.Send(Rtu(20, "64 DE AD BE EF 01"));
  ExpectReply(client, 20, "64 DE AD BE EF 01");
}

TEST_F(RtuOverTcpTest, AClientThatDisconnectsWhileWaitingIsForgotten) {
  Add(1, 20, 20);
  StartServer();
  RawClient client = Connect();
  client.Send(Rtu(20, kRead));
  const bus::RoutedRequest request = drive_.Wait(0);
  client.Close();
  EXPECT_EQ(drive_.WaitForgotten(0), request.client);
}

TEST_F(RtuOverTcpTest, AFloodingClientHasOnlyOnePendingRequest) {
  Add(1, 20, 20);
  StartServer();
  const RawClient client = Connect();
  constexpr std::size_t kMany = 4000;
  Bytes many;
  for (std::size_t i = 0; i < kMany; ++i) Append(many, View(Rtu(20, kRead)));
  client.Send(many);
  client.Send(Rtu(20, "03 00 07 00 01"));
  bus::RoutedRequest last = drive_.Wait(0);
  for (std::size_t i = 1; last.pdu[2] != 7; ++i) last = drive_.Wait(i);
  EXPECT_LT(drive_.count(), kMany / 2) << "most were given up before they were looked at";
  last.done(GoodReply("03 02 00 07"));
  ExpectReply(client, 20, "03 02 00 07");
  EXPECT_EQ(server_->Traffic().routes[0].dropped, drive_.count() - 1);
}

TEST_F(RtuOverTcpTest, AnAbsentSerialPortDoesNotBlockOtherListeners) {
  config_.modbus.listen.insert(config_.modbus.listen.begin(), listener());
  listener().path = "/dev/no-such-port";
  StartServer();
  EXPECT_EQ(server_->port(0), 0);
  const RawClient client(server_->port(1));
  client.Send(Rtu(1, "03 00 00 00 01"));
  ExpectReply(client, 1, "03 02 FF FE");
}

TEST_F(RtuOverTcpTest, AWriteToUnitZeroIsNeverAnswered) {
  Add(1, 0, 0).remap = 7;
  StartServer();
  const RawClient client = Connect();
  const bus::RoutedReply replies[] = {GoodReply("06 00 08 00 00"), SlaveException("86 02"),
                                      Trouble(Outcome::no_reply, "silence")};
  for (std::size_t i = 0; i < std::size(replies); ++i) {
    client.Send(Rtu(0, "06 00 08 00 00"));
    const bus::RoutedRequest request = drive_.Wait(i);
    EXPECT_EQ(request.slave, 7);
    request.done(replies[i]);
    client.Send(Rtu(1, "03 00 00 00 01"));
    ExpectReply(client, 1, "03 02 FF FE");
  }
}

TEST_F(RtuOverTcpTest, AMissingModuleIsAClearError) {
  links_.frames.rtu = nullptr;
  store_.emplace(config_);
  listener().port = 1;
  ModbusServer server(config_, *store_, sink_, {}, {}, links_);
  const Status status = server.Listen(io_);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error(),
            "127.0.0.1:1: Modbus RTU needs the module modbus_rtu, which is not loaded");
}

}  // namespace
}  // namespace baudgate::modbus
