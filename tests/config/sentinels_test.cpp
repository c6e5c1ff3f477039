// Sentinels of each protocol: what they mean in hex, and that those which can never come are named.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <limits>
#include <utility>

#include "config/loader.h"
#include "tests/config/fake_protocol.h"
#include "tests/config/shipped.h"

namespace baudgate::testing {
namespace {

config::Loaded LoadShipped(const std::string& protocol, const std::string& point) {
  return config::LoadText("lines:\n- { name: l, port: /dev/l, protocol: " + protocol +
                              ", devices: [{ name: d, address: 1, points: [{ name: p, " + point +
                              " }] }] }\n",
                          "x.yaml", Shipped());
}

TEST(Sentinels, InHexAreTheBitsOfWhatIsRead) {
  struct Case {
    const char* protocol;
    const char* point;
    Decimal value;
  };
  const Case cases[] = {
      {"modbus_rtu", "read: holding 1 int16, type: float32, sentinels: { 0x8000: uncertain }",
       -32768},
      {"modbus_rtu", "read: holding 1, type: int16, sentinels: { 0xFFFF: uncertain }", -1},
      {"modbus_rtu", "read: holding 1 uint16, type: float64, sentinels: { 0x8000: uncertain }",
       32768},
      {"modbus_rtu", "read: holding 1 int32, type: float64, sentinels: { 0x80000000: uncertain }",
       -2147483648LL},
      {"modbus_rtu", "read: holding 1 int24, type: float32, sentinels: { 0x800000: uncertain }",
       -8388608},
      {"modbus_rtu",
       "read: holding 1 int16 scale(2), type: float32, sentinels: { 0x8000: uncertain }", -32768},
      {"modbus_rtu", "read: holding 1, type: int64, sentinels: { 0x8000000000000000: uncertain }",
       std::numeric_limits<std::int64_t>::min()},
      {"modbus_rtu", "read: holding 1, type: uint64, sentinels: { 0xFFFFFFFFFFFFFFFF: uncertain }",
       std::numeric_limits<std::uint64_t>::max()},
      {"modbus_rtu", "read: holding 1, type: float32, sentinels: { 999.9: uncertain }",
       Decimal(999.9)},
      {"dcon", "read: \"$A[0]\", type: float32, sentinels: { 0x8000: uncertain }", -32768},
      {"set4tm", "read: \"08 01 i8@1\", type: float32, sentinels: { 0x80: uncertain }", -128},
      {"spabus", "read: I1, type: int16, sentinels: { 0x8000: uncertain }", -32768},
      {"spabus", "read: I1, type: float32, sentinels: { 1e3: uncertain }", 1000},
  };
  for (const Case& one : cases) {
    const auto loaded = LoadShipped(one.protocol, one.point);
    ASSERT_EQ(Shown(loaded.problems), "") << one.point;
    EXPECT_EQ(loaded.config.lines[0].devices[0].points[0].sentinels.at(0).value, one.value)
        << one.point;
  }
}

TEST(Sentinels, WhatCanNeverComeIsAnError) {
  const std::pair<const char*, const char*> cases[] = {
      {"modbus_rtu", "read: holding 1 int16, type: float32, sentinels: { 32768: uncertain }"},
      {"modbus_rtu", "read: holding 1 int16, type: float32, sentinels: { 999.9: uncertain }"},
      {"modbus_rtu", "read: holding 1 uint16, type: float32, sentinels: { -1: uncertain }"},
      {"modbus_rtu", "read: holding 1 uint16, type: float32, sentinels: { 0x10000: uncertain }"},
      {"modbus_rtu", "read: holding 1 bcd16, type: float32, sentinels: { 0xFFFF: uncertain }"},
      {"modbus_rtu", "read: \"holding 1[b0-b3]\", type: uint16, sentinels: { 16: uncertain }"},
      {"modbus_rtu", "read: holding 1, type: float32, sentinels: { 0x7FC00000: uncertain }"},
      {"modbus_rtu", "read: holding 1, type: float64, sentinels: { 0x8000: uncertain }"},
      {"modbus_rtu", "read: holding 1, type: float32, sentinels: { 16777217: uncertain }"},
      {"modbus_rtu", "read: holding 1 float32, type: float64, sentinels: { 1e39: uncertain }"},
      {"modbus_rtu",
       "read: holding 1 int16, type: float32, scale: 0.1, sentinels: { 3276.7: uncertain }"},
      {"modbus_rtu", "read: coil 1, type: bool, sentinels: { 2: uncertain }"},
      {"dcon", "read: \"#0 counter\", type: float64, sentinels: { -1: uncertain }"},
      {"dcon", "read: \"@[low]\", type: uint16, sentinels: { 256: uncertain }"},
      {"set4tm", "read: \"08 01 i8@1\", type: float32, sentinels: { 128: uncertain }"},
      {"modbus_rtu",
       "read: holding 1, type: int16, sentinels: { -1: uncertain, 0xFFFF: uncertain }"},
  };
  for (const auto& [protocol, point] : cases) {
    const auto loaded = LoadShipped(protocol, point);
    ASSERT_EQ(loaded.problems.size(), 1U) << point << Shown(loaded.problems);
    EXPECT_FALSE(loaded.problems[0].warning) << point;
    EXPECT_NE(loaded.problems[0].message.find("sentinels: "), std::string::npos) << point;
  }
}

}  // namespace
}  // namespace baudgate::testing
