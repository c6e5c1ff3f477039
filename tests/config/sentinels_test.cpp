// Tests sentinels of each protocol, and warnings about sentinels that can never occur.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <utility>

#include "config/loader.h"
#include "gateway/base/decimal.h"
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

TEST(Sentinels, InHexAreTheRawBitsOfTheReading) {
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

// ---------------- A number with a leading zero means 10 to some YAML readers and 8 to others, so
// it is an error wherever a number is expected. Text with a leading zero is not an error.

using ::testing::HasSubstr;

TEST(LeadingZero, NamesBothReadings) {
  EXPECT_EQ(WhyLeadingZero("010"),
            "has a leading zero: it is 10 in YAML 1.2, and 8 in YAML 1.1; write 10 or 8");
  EXPECT_THAT(WhyLeadingZero("-010"), HasSubstr("write -10 or -8"));
  EXPECT_EQ(WhyLeadingZero("01"), "has a leading zero; write 1");
  EXPECT_EQ(WhyLeadingZero("09"), "has a leading zero; write 9");
  EXPECT_EQ(WhyLeadingZero("00"), "has a leading zero; write 0");
  EXPECT_EQ(WhyLeadingZero("+00.5"), "has a leading zero; write 0.5");
  EXPECT_EQ(WhyLeadingZero("010ms"), "has a leading zero; write 10ms");
  for (const char* fine : {"0", "-0", "0.5", "10", "0x010", "1e05", "", "-", "a01", "0ms"}) {
    EXPECT_EQ(WhyLeadingZero(fine), "") << fine;
  }
}

TEST(MeantProtocol, IsFoundByCommonNames) {
  const struct {
    const char* name;
    const char* port;
    std::string_view meant;
  } rows[] = {
      {"SPA", "/dev/ttyUSB0", "spabus"},
      {"spa", "tcp://10.0.0.5:4001", "spabus"},
      {"SPAbus", "", "spabus"},
      {"spabuss", "", "spabus"},
      {"modbus", "/dev/ttyUSB0", "modbus_rtu"},
      {"Modbus", "tcp://10.0.0.5:502", "modbus_tcp"},
      {"modbus", "tcp://10.0.0.5:4001", "modbus_rtu"},
      {"modbus-rtu", "", "modbus_rtu"},
      {"modbus_asci", "", "modbus_ascii"},
      {"owen", "", "dcon"},
      {"ADAM", "", "dcon"},
      {"mercury", "", "set4tm"},
      {"set-4tm", "", "set4tm"},
      {"telex", "", ""},
      {"", "", ""},
  };
  for (const auto& row : rows) {
    const protocols::Protocol* meant = Shipped().MeantProtocol(row.name, row.port);
    EXPECT_EQ(meant == nullptr ? "" : meant->name, row.meant) << row.name << " " << row.port;
  }
  EXPECT_EQ(Shipped().NeedProtocol("SPA").error().substr(0, 51),
            "'SPA' is not installed; did you mean 'spabus'? inst");
}

}  // namespace
}  // namespace baudgate::testing
