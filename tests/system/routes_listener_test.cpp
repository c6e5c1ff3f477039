// What listeners of transparent routes let through, and in which form.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "tests/system/libmodbus_slave.h"
#include "tests/system/messages.h"
#include "tests/system/null_modem.h"
#include "tests/system/routes_fixture.h"

namespace baudgate::system_test {
namespace {

using ::testing::HasSubstr;

TEST_F(Routes, OfASilentListenerLeaveTheirClientsToTheirTimeouts) {
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

TEST_F(Routes, OfAListenerThatOnlyReadsTakeNoWrites) {
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

}  // namespace
}  // namespace baudgate::system_test
