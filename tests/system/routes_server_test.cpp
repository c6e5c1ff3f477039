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

/// Not a route: its registers are points of this gateway, in its own store.
TEST_F(Routes, AreNotNeededForAModbusTcpServerAsADevice) {
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
