// Tests transparent routes as masters see them: exceptions, counters, and wrong routes.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <set>
#include <vector>

#include "gateway/base/text.h"
#include "tests/system/libmodbus_slave.h"
#include "tests/system/messages.h"
#include "tests/system/null_modem.h"
#include "tests/system/routes_fixture.h"

namespace baudgate::system_test {
namespace {

using ::testing::HasSubstr;

TEST_F(Routes, ReturnTheExceptionOfEachFailure) {
  const ScriptedSlave muted(LinkOf("muted"), Nothing);
  const NullModem cable(LinkOf("drive"), FarEnd("drive"));
  const auto slave = LibmodbusSlave::OnTty(FarEnd("drive"), kUnit);
  const auto daemon = StartGateway(
      Yaml({kRoute, "{ units: 21, line: muted }", "{ units: 22, line: absent }"},
           BareLine("drive") + BareLine("muted", "timing: { reply: 100ms }") + BareLine("absent")),
      {"drive", "muted"});
  ModbusClient client(port());
  EXPECT_EQ(client.Holding(kUnit, 999, 1).values, std::vector<std::uint16_t>{1999});
  EXPECT_EQ(client.Holding(kUnit, 1000, 1).exception, kIllegalAddress) << "the slave's own";
  EXPECT_EQ(client.Holding(21, 0, 1).exception, kNotAnswering);
  EXPECT_EQ(client.Holding(22, 0, 1).exception, kNotAnswering) << "its port is absent";
  EXPECT_EQ(client.Holding(23, 0, 1).exception, kNoPath);
  EXPECT_EQ(client.WriteRegister(23, 0, 1), kNoPath);
  EXPECT_THAT(MbpollTcp("20", {"-r", "1000"}).errors, HasSubstr("Illegal data address"));
  EXPECT_THAT(MbpollTcp("21", {"-r", "0"}).errors, HasSubstr("Target device failed to respond"));
  EXPECT_THAT(MbpollTcp("23", {"-r", "0"}).errors, HasSubstr("Gateway path unavailable"));
  const std::string at = std::to_string(port());
  const auto exception = [](int code) { return Json::array({{{"exception", code}}}); };
  EXPECT_EQ(Pymodbus("tcp", at, 20, {"holding:1000:1"}), exception(kIllegalAddress));
  EXPECT_EQ(Pymodbus("tcp", at, 21, {"holding:0:1"}), exception(kNotAnswering));
  EXPECT_EQ(Pymodbus("tcp", at, 23, {"holding:0:1"}), exception(kNoPath));
}

TEST_F(Routes, CountersMatchTheTraffic) {
  const NullModem cable(LinkOf("drive"), FarEnd("drive"));
  const auto slave = LibmodbusSlave::OnTty(FarEnd("drive"), kUnit);
  const auto daemon = StartGateway(
      Yaml({"{ units: 20-21, line: drive }"}, BareLine("drive", "timing: { reply: 400ms }")));
  RawClient client(port());
  constexpr std::uint64_t kReads = 5;
  for (std::uint16_t i = 0; i < kReads; ++i) {
    Send(client, ReadRequest(i, kUnit, i));
    ASSERT_TRUE(Receive(client));
  }
  Send(client, ReadRequest(10, kUnit, 1000));
  EXPECT_EQ(ExceptionIn(Receive(client).value()), kIllegalAddress);
  Send(client, ReadRequest(11, 21, 0));
  EXPECT_EQ(ExceptionIn(Receive(client).value()), kNotAnswering);

  const Json status = Status();
  const Json route = status["modbus"]["routes"][0];
  EXPECT_EQ(route["target"], "line drive");
  EXPECT_EQ(route["requests"], kReads + 2);
  EXPECT_EQ(route["ok"], kReads);
  EXPECT_EQ(route["refused"], 1);
  EXPECT_EQ(route["no_reply"], 1);
  for (const char* nothing : {"expired", "busy", "dropped", "broadcasts", "shared"}) {
    EXPECT_EQ(route[nothing], 0) << nothing;
  }
  EXPECT_THAT(route["last_trouble"], testing::Ne(""));
  ASSERT_EQ(route["by_unit"].size(), 2U);
  EXPECT_EQ(route["by_unit"][0]["unit"], 20);
  EXPECT_EQ(route["by_unit"][0]["ok"], kReads);
  EXPECT_EQ(route["by_unit"][1]["no_reply"], 1);

  Json mine;
  for (const Json& peer : status["modbus"]["clients"]) {
    if (peer["requests"] == kReads + 2) mine = peer;
  }
  ASSERT_TRUE(mine.is_object()) << status["modbus"];
  EXPECT_EQ(mine["exceptions"], 2);
  EXPECT_EQ(mine["outstanding"], 0);
  EXPECT_EQ(mine["bytes_in"], (kReads + 2) * 12);
  EXPECT_EQ(mine["bytes_out"], kReads * 11 + 2 * 9);

  const Json line = status["lines"][0];
  EXPECT_EQ(line["exchanges"], kReads + 2);
  EXPECT_EQ(line["outcomes"]["ok"], kReads);
  EXPECT_EQ(line["bytes_out"], cable.bytes_to_far());
  EXPECT_EQ(line["bytes_in"], cable.bytes_to_near());
  EXPECT_EQ(line["bytes_out"], (kReads + 2) * 8);
  EXPECT_EQ(line["bytes_in"], kReads * 7 + 5);
}

TEST_F(Routes, ForwardOddRepliesUnchanged) {
  const std::map<std::string, std::string> odd = {{"03 13 89 00 01", "03 04 00 01 00 02"},
                                                  {"06 00 0D 00 6C", "06 00 0D 00 64"},
                                                  {"10 00 00 00 01 02 00 02", ""}};
  const ScriptedSlave slave(LinkOf("drive"), [&](View request) -> std::vector<Piece> {
    const auto found = odd.find(ToHex(request.subspan(1, request.size() - 3)));
    if (found == odd.end()) return Answer(request);
    if (found->second.empty()) return {{0ms, Bytes(request.begin(), request.end())}};
    return {{0ms, RtuFrame(kUnit, ParseHex(found->second).value())}};
  });
  ASSERT_TRUE(slave.connected());
  const auto daemon = StartGateway(Yaml({kRoute}, BareLine("drive")));
  ModbusClient other(port());
  EXPECT_EQ(other.Holding(kUnit, 5, 1).values, std::vector<std::uint16_t>{1005});
  RawClient client(port());
  for (std::uint16_t i = 0; i < 6; ++i) {
    for (const auto& [request, reply] : odd) {
      Send(client, {i, kUnit, ParseHex(request).value()});
      const auto got = Receive(client);
      ASSERT_TRUE(got);
      EXPECT_EQ(ToHex(got->pdu), reply.empty() ? request : reply);
    }
    EXPECT_EQ(other.Holding(kUnit, 5, 1).values, std::vector<std::uint16_t>{1005});
  }
}

TEST_F(Routes, WrongRoutesAreReportedWithTheirPlace) {
  const std::string file =
      Write("wrong.yaml", Yaml({"{ units: 20, line: driev }", "{ units: 20-300, line: drive }"},
                               BareLine("drive")))
          .string();
  const Finished run = Command({"run", "-c", file});
  EXPECT_EQ(run.code, 3);
  EXPECT_THAT(run.errors, HasSubstr(file + ":6:26: "));
  EXPECT_THAT(run.errors, HasSubstr(file + ":7:16: "));
  EXPECT_THAT(run.errors, HasSubstr("did you mean 'drive'?"));
}

TEST_F(Routes, ASilentListenerReturnsNoExceptionsOfRoutes) {
  const ScriptedSlave muted(LinkOf("drive"), Nothing);
  const std::uint16_t quiet = FreePort();
  const auto daemon =
      StartGateway(Yaml({kRoute}, BareLine("drive", "timing: { reply: 50ms }"),
                        {"{ at: \"127.0.0.1:" + std::to_string(quiet) + "\", errors: silent }"}));
  const Finished unanswered = Mbpoll(
      {"-m", "tcp", "-p", std::to_string(quiet), "-a", "20", "-r", "0", "-o", "0.5", "127.0.0.1"});
  EXPECT_EQ(unanswered.code, 1);
  EXPECT_THAT(unanswered.errors, HasSubstr("Connection timed out"));
  RawClient client(quiet);
  Send(client, ReadRequest(1, kUnit, 0));
  Send(client, ReadRequest(2, 99, 0));
  Send(client, {3, 0, {4, 0x23, 0x28, 0, 1}});
  const auto only = Receive(client);
  ASSERT_TRUE(only);
  EXPECT_EQ(only->transaction, 3) << "the gateway's own block: neither 0x0B nor 0x0A before it";
  EXPECT_EQ(ModbusClient(port()).Holding(kUnit, 0, 1).exception, kNotAnswering)
      << "the other listener says so";
}

TEST_F(Routes, AReadOnlyListenerRefusesWrites) {
  const ScriptedSlave slave(LinkOf("drive"), Answer);
  const std::uint16_t readers = FreePort();
  const auto daemon =
      StartGateway(Yaml({kRoute}, BareLine("drive"),
                        {"{ at: \"127.0.0.1:" + std::to_string(readers) + "\", write: deny }"}));
  ModbusClient reader(readers);
  EXPECT_EQ(reader.Holding(kUnit, 7, 1).values, std::vector<std::uint16_t>{1007});
  EXPECT_EQ(reader.WriteRegister(kUnit, 7, 1), kIllegalFunction);
  EXPECT_EQ(ModbusClient(port()).WriteRegister(kUnit, 7, 1), kNoException);
}

TEST_F(Routes, TakeRtuOverTcpOfPymodbus) {
  const NullModem cable(LinkOf("drive"), FarEnd("drive"));
  const auto slave = LibmodbusSlave::OnTty(FarEnd("drive"), kUnit);
  const std::uint16_t rtu = FreePort();
  const auto daemon =
      StartGateway(Yaml({kRoute}, BareLine("drive"),
                        {"{ at: \"127.0.0.1:" + std::to_string(rtu) + "\", framing: rtu }"}));
  const Json results = Pymodbus("rtu", std::to_string(rtu), kUnit,
                                {"holding:7:2", "input:7:1", "register:7:70", "holding:7:2",
                                 "holding:1000:1", "write_registers:8:71:72", "holding:6:125"});
  ASSERT_EQ(results.size(), 7U) << results;
  EXPECT_EQ(results[0], Json({1007, 1008}));
  EXPECT_EQ(results[1], Json({2007}));
  EXPECT_EQ(results[2], true);
  EXPECT_EQ(results[3], Json({70, 1008}));
  EXPECT_EQ(results[4], Json({{"exception", kIllegalAddress}}));
  EXPECT_EQ(results[5], true);
  ASSERT_EQ(results[6].size(), 125U) << results[6];
  EXPECT_EQ(results[6][0], 1006);
  EXPECT_EQ(results[6][3], 72);
  EXPECT_EQ(results[6][124], 1130);
}

TEST_F(Routes, AFullRouteAnswersBusy) {
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

TEST_F(Routes, AFullRouteStillAcceptsAShortWrite) {
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

TEST_F(Routes, ForwardRequestsToAModbusTcpServer) {
  const std::uint16_t elsewhere = FreePort();
  auto server = LibmodbusSlave::OnTcp(elsewhere);
  ASSERT_TRUE(server->connected());
  const auto daemon = StartGateway(
      Yaml({"{ units: 50, server: \"127.0.0.1:" + std::to_string(elsewhere) + "\", remap: 7 }",
            "{ units: 51, server: \"127.0.0.1:" + std::to_string(FreePort()) + "\" }",
            "{ units: 52, server: \"127.0.0.1:" + std::to_string(elsewhere) + "\", remap: 0 }"},
           "  []\n"),
      {});
  ModbusClient client(port());
  EXPECT_EQ(client.Holding(50, 3, 2).values, (std::vector<std::uint16_t>{1003, 1004}));
  EXPECT_EQ(server->last_unit(), 7);
  EXPECT_EQ(client.WriteRegisters(50, 3, {8, 9}), kNoException);
  EXPECT_EQ(client.Holding(50, 2, 4).values, (std::vector<std::uint16_t>{1002, 8, 9, 1005}));
  EXPECT_EQ(client.Holding(50, 1000, 1).exception, kIllegalAddress);
  EXPECT_EQ(client.WriteRegister(52, 5, 77), kNoException) << "no broadcast";
  EXPECT_EQ(server->last_unit(), 0);
  EXPECT_EQ(client.Holding(52, 5, 1).values, std::vector<std::uint16_t>{77});
  EXPECT_EQ(client.Holding(51, 0, 1).exception, kNotAnswering) << "nobody listens there";

  server.reset();
  EXPECT_EQ(client.Holding(50, 3, 1).exception, kNotAnswering);
  server = LibmodbusSlave::OnTcp(elsewhere);
  ASSERT_TRUE(server->connected());
  EXPECT_TRUE(Eventually([&] { return client.Holding(50, 3, 1).ok(); })) << "it is back";
  EXPECT_EQ(client.Holding(50, 3, 1).values, std::vector<std::uint16_t>{1003});
}

TEST_F(Routes, AModbusTcpServerCanBeADeviceWithoutARoute) {
  const std::uint16_t elsewhere = FreePort();
  auto server = LibmodbusSlave::OnTcp(elsewhere);
  ASSERT_TRUE(server->connected());
  const auto device = [](const std::string& name, const std::string& address, int unit) {
    return "      - name: " + name + "\n        address: " + address +
           "\n        unit: " + std::to_string(unit) +
           "\n        poll: 100ms\n        write: [level]\n        points:\n"
           "          - { name: level, read: holding 3, type: uint16, modbus: 10, access: rw }\n"
           "          - { name: pump, read: coil 3, type: bool, modbus: 0 }\n"
           "          - { name: total, read: input 7 uint32, type: uint32, modbus: 20 }\n"
           "          - { name: beyond, read: holding 1000, type: uint16, modbus: 30 }\n";
  };
  const auto daemon = StartGateway(
      Yaml({}, "  - name: plc\n    port: tcp://127.0.0.1:" + std::to_string(elsewhere) +
                   "\n    protocol: modbus_tcp\n    devices:\n" + device("itself", "255", 40) +
                   device("behind", "7", 41)),
      {});
  ModbusClient client(port());
  for (const std::uint8_t unit : {std::uint8_t{40}, std::uint8_t{41}}) {
    ASSERT_TRUE(Eventually([&] {
      return client.Holding(unit, 20010, 1).values == std::vector<std::uint16_t>{192};
    })) << daemon->Errors();
    EXPECT_EQ(client.Holding(unit, 10, 1).values, std::vector<std::uint16_t>{1003});
    EXPECT_TRUE(Eventually([&] {
      return client.Holding(unit, 20, 2).values == std::vector<std::uint16_t>{2007, 2008};
    }));
  }
  EXPECT_EQ(client.WriteRegister(40, 10, 77), kNoException);
  EXPECT_TRUE(Eventually([&] {
    return client.Holding(41, 10, 1).values == std::vector<std::uint16_t>{77};
  })) << "the same register by another unit";
  server.reset();
  EXPECT_TRUE(Eventually([&] { return client.Holding(40, 10, 1).exception == kNotAnswering; }));
  server = LibmodbusSlave::OnTcp(elsewhere);
  ASSERT_TRUE(server->connected());
  EXPECT_TRUE(Eventually([&] { return client.Holding(40, 10, 1).ok(); })) << "it is back";
}

TEST_F(Routes, ForwardRequestsThroughAnotherGateway) {
  const ScriptedSlave slave(LinkOf("drive"), Answer);
  const std::uint16_t near = FreePort();
  const auto far_gateway = StartGateway(Yaml({kRoute}, BareLine("drive")));
  const auto near_gateway = Start(
      {"run", "-c",
       Write("near.yaml", "gateway: { name: near, socket: " + (directory() / "near.sock").string() +
                              " }\nmodbus:\n  listen: \"127.0.0.1:" + std::to_string(near) +
                              "\"\n  routes:\n    - { units: 60-61, server: \"127.0.0.1:" +
                              std::to_string(port()) +
                              "\", remap: 20 }\ndds: { enabled: false }\nlines: []\n")
           .string()});
  ModbusClient client(near);
  ASSERT_TRUE(Eventually([&] { return client.Holding(60, 5, 1).ok(); })) << near_gateway->Errors();
  EXPECT_EQ(client.Holding(60, 5, 3).values, (std::vector<std::uint16_t>{1005, 1006, 1007}));
  EXPECT_EQ(client.WriteRegister(60, 5, 1), kNoException);
  EXPECT_EQ(client.Holding(61, 5, 1).exception, kNoPath) << "the far gateway's own exception";
}

}  // namespace
}  // namespace baudgate::system_test
