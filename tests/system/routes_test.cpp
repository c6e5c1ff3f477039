// Transparent routes as masters see them: exceptions of each kind, the counters, and routes that
// are wrong.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <map>

#include "gateway/base/text.h"
#include "tests/system/libmodbus_slave.h"
#include "tests/system/messages.h"
#include "tests/system/null_modem.h"
#include "tests/system/routes_fixture.h"

namespace baudgate::system_test {
namespace {

using ::testing::HasSubstr;

TEST_F(Routes, ThatFailAreExceptionsOfTheirKind) {
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

TEST_F(Routes, AreCountedAsTheTrafficWas) {
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

  // The daemon's own start was asked for by another client, which has left or not.
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

/// Registers of 32 bits, a device that limits what is written, and a write that comes back whole.
TEST_F(Routes, BringOddRepliesAsTheyCame) {
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

TEST_F(Routes, ThatAreWrongEndTheProgramWithTheirPlace) {
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

}  // namespace
}  // namespace baudgate::system_test
