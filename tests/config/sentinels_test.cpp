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

}  // namespace
}  // namespace baudgate::testing
