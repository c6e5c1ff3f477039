// Reads and exceptions through a real socket, framing, pipelining, and how ports are opened.
// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <unistd.h>

#include "gateway/outputs/modbus/server/modbus_server.h"
#include "tests/gateway/outputs/modbus/server/server_fixture.h"

namespace baudgate::modbus {
namespace {

TEST_F(ServerTest, RegistersAndBitsInBothTables) {
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

TEST_F(ServerTest, EveryException) {
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

TEST_F(ServerTest, StatusOfADeviceAndOfTheGateway) {
  StartServer();
  store_->UpdateStatus(0, [](DeviceStatus& status) { status.state = DeviceState::online; });
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

TEST_F(ServerTest, EveryCutOfARequestAndADribble) {
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

TEST_F(ServerTest, ATakenPortIsAClearError) {
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
  EXPECT_EQ(status.error(), "192.0.2.1:0: this machine has no such address; check modbus.listen");
}

/// In a process of its own: what stands at descriptor 3 is lost.
TEST_F(ServerTest, AnAddressThatHasLeftTheMachineIsNamed) {
  const auto trouble = [this] {
    asio::io_context io;
    asio::ip::tcp::acceptor gone(io, asio::ip::tcp::v4());
    // Binds to an address that the machine does not have, as if it had left.
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

}  // namespace
}  // namespace baudgate::modbus
