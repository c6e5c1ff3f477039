// A number with a leading zero is 10 to some readers and 8 to others: an error wherever numbers
// stand, and nowhere else.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "config/loader.h"
#include "gateway/base/decimal.h"
#include "tests/config/fake_protocol.h"
#include "tests/config/shipped.h"

namespace baudgate::testing {
namespace {

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

std::string OfDevice(const std::string& protocol, const std::string& device) {
  return Shown(config::LoadText("lines:\n- { name: l, port: /dev/l, protocol: " + protocol +
                                    ", devices: [{ name: d, address: 1, " + device + " }] }\n",
                                "x.yaml", Shipped())
                   .problems);
}

std::string Of(const std::string& protocol, const std::string& option) {
  return OfDevice(protocol, "points: [], " + option);
}

std::string OfPoint(const std::string& protocol, const std::string& point) {
  return OfDevice(protocol, "points: [{ name: p, " + point + " }]");
}

TEST(LeadingZero, IsAnErrorInEveryNumber) {
  const auto at = [](const std::string& protocol, const std::string& address) {
    return Shown(config::LoadText("lines:\n- { name: l, port: /dev/l, protocol: " + protocol +
                                      ", devices: [{ name: d, address: " + address +
                                      ", points: [] }] }\n",
                                  "x.yaml", Shipped())
                     .problems);
  };
  for (const char* protocol : {"modbus_rtu", "spabus", "dcon", "set4tm", "telegram", "reader"}) {
    EXPECT_THAT(at(protocol, "010"), HasSubstr("write 10 or 8")) << protocol;
    EXPECT_THAT(at(protocol, "\"010\""), HasSubstr("write 10 or 8")) << protocol;
  }
  const std::pair<const char*, const char*> points[] = {
      {"modbus_rtu", "read: holding 010, type: int16"},
      {"modbus_rtu", "read: \"holding 8[b03]\", type: bool"},
      {"modbus_rtu", "read: holding 8 int16 scale(010), type: float32"},
      {"modbus_rtu", "read: holding 8 string(010), type: string(10)"},
      {"modbus_rtu", "read: \"file 04:1 uint16\", type: uint16"},
      {"modbus_rtu", "read: holding 8, write: holding 010, access: rw, type: int16"},
      {"modbus_rtu", "read: holding 8, type: string(010)"},
      {"modbus_rtu", "read: holding 8, type: int16, modbus: 010"},
      {"modbus_rtu", "read: holding 8, type: int16, scale: 010"},
      {"modbus_rtu", "read: holding 8, type: float32, scale: 00.1"},
      {"modbus_rtu", "read: holding 8, type: int16, offset: -010"},
      {"modbus_rtu", "read: holding 8, type: int16, min: 010"},
      {"modbus_rtu", "read: holding 8, type: int16, sentinels: { 0999: uncertain }"},
      {"modbus_rtu", "read: holding 8, type: int16, modbus: 1, on_fault: 010"},
      {"modbus_rtu", "read: holding 8, type: int16, simulate: [010, 20]"},
      {"modbus_rtu", "read: holding 8, type: int16, poll: 010s"},
      {"spabus", "read: 014V1, type: int16"},
      {"spabus", "read: I01, type: int16"},
      {"dcon", "read: \"#[03]\", type: float32"},
      {"dcon", "read: \"$6[b03]\", type: bool"},
      {"set4tm", "read: \"08 1B 00 11 float_le@01\", type: float32"},
      {"reader", "read: number 04-11, type: float32"},
  };
  for (const auto& [protocol, point] : points) {
    EXPECT_THAT(OfPoint(protocol, point), HasSubstr("has a leading zero")) << point;
  }
  for (const char* const device : {"unit: 010", "retries: 02", "max_age: 010s", "block: 010"}) {
    EXPECT_THAT(Of("modbus_rtu", device), HasSubstr("has a leading zero")) << device;
  }
  for (const char* const top :
       {"modbus: { listen: \"127.0.0.1:01502\" }",
        "modbus: { listen: { at: \"127.0.0.1:1502\", allow: [127.0.0.0/08] } }",
        "modbus: { routes: [{ units: \"033-040\", line: l }] }",
        "modbus: { routes: [{ units: 033, line: l }] }",
        "modbus: { routes: [{ units: 33-40, line: l, remap: 01 }] }", "dds: { domain: 010 }"}) {
    const std::string text = "lines:\n- { name: l, port: /dev/l, protocol: modbus_rtu }\n";
    EXPECT_THAT(Shown(config::LoadText(text + top + "\n", "x.yaml", Shipped()).problems),
                HasSubstr("has a leading zero"))
        << top;
  }
  EXPECT_THAT(Shown(config::LoadText("lines:\n- { name: l, port: \"tcp://10.0.0.5:0502\", "
                                     "protocol: modbus_tcp }\n",
                                     "x.yaml", Shipped())
                        .problems),
              HasSubstr("0502 has a leading zero"));
  EXPECT_THAT(Shown(config::LoadText("lines:\n- { name: l, port: /dev/l, serial: 09600 8N1, "
                                     "protocol: modbus_rtu }\n",
                                     "x.yaml", Shipped())
                        .problems),
              HasSubstr("has a leading zero"));
}

TEST(LeadingZero, IsFineInTexts) {
  EXPECT_EQ(Of("set4tm", "password: \"000000\""), "");
  EXPECT_EQ(Of("spabus", "password: 001"), "");
  EXPECT_EQ(Of("dcon", "types: [\"08\", \"09\"]"), "");
  EXPECT_EQ(OfPoint("dcon", "read: \"#00\", type: float32"), "");
  EXPECT_EQ(OfPoint("dcon", "read: \"#01\", type: float32"), "");
  EXPECT_EQ(OfPoint("set4tm", "read: \"08 01 i8@1\", type: float32"), "");
  EXPECT_EQ(OfPoint("modbus_rtu", "read: holding 0x010, type: int16"), "");
}

}  // namespace
}  // namespace baudgate::testing
