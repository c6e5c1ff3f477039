// Clients that speak RTU over TCP: one request at a time, the last one, damage, silence, and cached
// units.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "tests/gateway/outputs/modbus/service/route_fixture.h"

namespace baudgate::modbus {
namespace {

class RtuOverTcpTest : public RouteTest {
 protected:
  RtuOverTcpTest() { listener().framing = Framing::rtu; }

  static Bytes Rtu(std::uint8_t slave, const std::string& pdu) {
    return ModbusRtuProtocol().carrier->wrap(slave, ParseHex(pdu).value());
  }
  /// Receives as many bytes as the reply with this PDU has.
  static void ExpectReply(const RawClient& client, std::uint8_t slave, const std::string& pdu) {
    const Bytes expected = Rtu(slave, pdu);
    EXPECT_EQ(ToHex(client.Receive(expected.size())), ToHex(expected));
  }
};

TEST_F(RtuOverTcpTest, CachedUnitsRoutesAndExceptions) {
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

TEST_F(RtuOverTcpTest, EveryCutOfARequest) {
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

TEST_F(RtuOverTcpTest, AClientThatAsksAnewHasGivenUp) {
  Add(1, 20, 20);
  StartServer();
  const RawClient client = Connect();
  client.Send(Rtu(20, "03 00 C8 00 01"));
  const RoutedRequest first = drive_.Wait(0);
  client.Send(Rtu(20, "03 00 C9 00 01"));
  const RoutedRequest second = drive_.Wait(1);
  EXPECT_EQ(drive_.WaitForgotten(0), first.client);
  first.done(GoodReply("03 02 00 C8"));
  second.done(GoodReply("03 02 00 C9"));
  ExpectReply(client, 20, "03 02 00 C9");
  client.Send(Rtu(1, "03 00 00 00 01"));
  ExpectReply(client, 1, "03 02 FF FE");
  EXPECT_EQ(server_->Traffic().routes[0].dropped, 1U);
}

TEST_F(RtuOverTcpTest, AWriteThatWasGivenUpIsNeverAnswered) {
  StartServer();
  const RawClient client = Connect();
  client.Send(Rtu(1, "06 00 00 00 2A"));
  const WriteCommand write = sink_.Wait(0);
  client.Send(Rtu(1, "03 00 00 00 01"));
  ExpectReply(client, 1, "03 02 FF FE");
  write.done({});
  client.Send(Rtu(1, "03 00 00 00 03"));
  ExpectReply(client, 1, "03 06 FF FE 47 F1 20 00");
}

TEST_F(RtuOverTcpTest, OfRequestsThatComeTogetherTheLastIsAnswered) {
  Add(1, 20, 20);
  StartServer();
  const RawClient client = Connect();
  Bytes together = Rtu(1, "03 00 00 00 01");
  Append(together, View(Rtu(20, "06 00 08 00 02")));
  Append(together, View(Rtu(20, "03 00 02 00 01")));
  client.Send(together);
  const RoutedRequest asked = drive_.Wait(0);
  EXPECT_EQ(ToHex(asked.pdu), "03 00 02 00 01") << "nobody waits for those before";
  asked.done(GoodReply("03 02 00 02"));
  ExpectReply(client, 20, "03 02 00 02");
}

TEST_F(RtuOverTcpTest, NoAnswerGoesOutIntoTheNextRequest) {
  Add(1, 20, 20);
  StartServer();
  const RawClient client = Connect();
  client.Send(Rtu(20, "03 00 C8 00 01"));
  const RoutedRequest first = drive_.Wait(0);
  const Bytes next = Rtu(1, "03 00 00 00 01");
  client.Send(View(next).first(5));
  first.done(GoodReply("03 02 00 C8"));
  // Whoever is served meanwhile shows that the server has had its turn.
  const RawClient other = Connect();
  other.Send(Rtu(1, "03 00 00 00 01"));
  ExpectReply(other, 1, "03 02 FF FE");
  client.Send(View(next).subspan(5));
  ExpectReply(client, 1, "03 02 FF FE");
}

TEST_F(RtuOverTcpTest, BytesBehindARequestThatBecomeNoneDoNotKeepItsAnswer) {
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

TEST_F(RtuOverTcpTest, DamageIsNeverAnswered) {
  Add(1, 20, 20);
  drive_.answer = Count;
  StartServer();
  const RawClient client = Connect();
  const RawClient other = Connect();
  // An answer that only silence releases, and what the client sent before has met the same.
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

TEST_F(RtuOverTcpTest, AfterARequestWithoutAnswerTheNextOneComes) {
  listener().errors = config::Listener::Errors::silent;
  listener().broadcast = config::Listener::Broadcast::pass;
  Add(1, 20, 20);
  drive_.answer = [](const RoutedRequest& request) {
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

TEST_F(RtuOverTcpTest, AFunctionOfUnknownLengthEndsWithSilence) {
  Add(1, 20, 20);
  drive_.answer = [](const RoutedRequest& request) { return GoodReply(request.pdu); };
  StartServer();
  const RawClient client = Connect();
  client.Send(Rtu(20, "64 DE AD BE EF 01"));
  ExpectReply(client, 20, "64 DE AD BE EF 01");
}

TEST_F(RtuOverTcpTest, AClientThatLeavesWhileItWaitsIsForgotten) {
  Add(1, 20, 20);
  StartServer();
  RawClient client = Connect();
  client.Send(Rtu(20, kRead));
  const RoutedRequest request = drive_.Wait(0);
  client.Close();
  EXPECT_EQ(drive_.WaitForgotten(0), request.client);
}

TEST_F(RtuOverTcpTest, AClientThatSendsWithoutEndHasOneRequestUnderWay) {
  Add(1, 20, 20);
  StartServer();
  const RawClient client = Connect();
  constexpr std::size_t kMany = 4000;
  Bytes many;
  for (std::size_t i = 0; i < kMany; ++i) Append(many, View(Rtu(20, kRead)));
  client.Send(many);
  client.Send(Rtu(20, "03 00 07 00 01"));
  RoutedRequest last = drive_.Wait(0);
  for (std::size_t i = 1; last.pdu[2] != 7; ++i) last = drive_.Wait(i);
  EXPECT_LT(drive_.count(), kMany / 2) << "most were given up before they were looked at";
  last.done(GoodReply("03 02 00 07"));
  ExpectReply(client, 20, "03 02 00 07");
  EXPECT_EQ(server_->Traffic().routes[0].dropped, drive_.count() - 1);
}

TEST_F(RtuOverTcpTest, AnAbsentSerialPortKeepsNoOtherListenerClosed) {
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
  const RoutedReply replies[] = {GoodReply("06 00 08 00 00"), SlaveException("86 02"),
                                 Trouble(Outcome::no_reply, "silence")};
  for (std::size_t i = 0; i < std::size(replies); ++i) {
    client.Send(Rtu(0, "06 00 08 00 00"));
    const RoutedRequest request = drive_.Wait(i);
    EXPECT_EQ(request.slave, 7);
    request.done(replies[i]);
    client.Send(Rtu(1, "03 00 00 00 01"));
    ExpectReply(client, 1, "03 02 FF FE");
  }
}

TEST_F(RtuOverTcpTest, WithoutTheModuleItIsAClearError) {
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
