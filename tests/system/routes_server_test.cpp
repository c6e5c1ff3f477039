// Transparent routes to servers elsewhere, and through another gateway.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "tests/system/libmodbus_slave.h"
#include "tests/system/routes_fixture.h"

namespace baudgate::system_test {
namespace {

TEST_F(Routes, LeadToAModbusTcpServerElsewhere) {
  const std::uint16_t elsewhere = FreePort();
  auto server = LibmodbusSlave::OnTcp(elsewhere);
  ASSERT_TRUE(server->connected());
  const auto daemon = StartGateway(
      Yaml({"{ units: 50, server: \"127.0.0.1:" + std::to_string(elsewhere) + "\", remap: 7 }",
            "{ units: 51, server: \"127.0.0.1:" + std::to_string(FreePort()) + "\" }"},
           "  []\n"),
      {});
  ModbusClient client(port());
  EXPECT_EQ(client.Holding(50, 3, 2).values, (std::vector<std::uint16_t>{1003, 1004}));
  EXPECT_EQ(server->last_unit(), 7);
  EXPECT_EQ(client.WriteRegisters(50, 3, {8, 9}), kNoException);
  EXPECT_EQ(client.Holding(50, 2, 4).values, (std::vector<std::uint16_t>{1002, 8, 9, 1005}));
  EXPECT_EQ(client.Holding(50, 1000, 1).exception, kIllegalAddress);
  EXPECT_EQ(client.Holding(51, 0, 1).exception, kNotAnswering) << "nobody listens there";

  server.reset();
  EXPECT_EQ(client.Holding(50, 3, 1).exception, kNotAnswering);
  server = LibmodbusSlave::OnTcp(elsewhere);
  ASSERT_TRUE(server->connected());
  EXPECT_TRUE(Eventually([&] { return client.Holding(50, 3, 1).ok(); })) << "it is back";
  EXPECT_EQ(client.Holding(50, 3, 1).values, std::vector<std::uint16_t>{1003});
}

TEST_F(Routes, LeadThroughAnotherGateway) {
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
