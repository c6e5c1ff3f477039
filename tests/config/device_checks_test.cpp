// What the shipped protocols find wrong with a whole device, and where they say so.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/config/fake_protocol.h"
#include "tests/config/shipped.h"

namespace baudgate::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::string ProblemsOf(const std::string& protocol, const std::string& keys) {
  return Shown(config::LoadText("lines:\n- { name: l, port: /dev/l, protocol: " + protocol +
                                    ", devices: [\n  { name: d, address: 1, " + keys + " }] }\n",
                                "t.yaml", Shipped())
                   .problems);
}

TEST(DeviceChecks, Set4tmFindsAMalformedPasswordWithoutShowingIt) {
  const std::string expected =
      "t.yaml:3:3: error: device 'd': the password must be 6 ASCII characters, or 6 bytes as "
      "\"hex:01 02 03 04 05 06\"\n";
  for (const char* const bad : {"hunter22", "\"12345\"", "\"hex:01 02 03\"", "\"\""}) {
    EXPECT_EQ(ProblemsOf("set4tm", std::string("profile: set-4tm.02, password: ") + bad), expected)
        << bad;
  }
  for (const char* const good : {"hunter", "000000", "\"hex:01 02 03 04 05 06\""}) {
    EXPECT_EQ(ProblemsOf("set4tm", std::string("profile: set-4tm.02, password: ") + good), "")
        << good;
  }
}

TEST(DeviceChecks, DconFindsACodeWithTwoMeanings) {
  EXPECT_EQ(ProblemsOf("dcon", "profile: icpdas-i-7017, over: [\"+9\", \"+8\"], open: [\"+8\"]"),
            "t.yaml:3:3: error: device 'd': '+8' stands in 'over' and in 'open'; it can mean one "
            "of them only\n");
}

TEST(DeviceChecks, DconFindsATypeCodeThatIsNone) {
  for (const char* const type : {"8", "0G", "080", "-8"}) {
    EXPECT_EQ(ProblemsOf("dcon", std::string("profile: icpdas-i-7017, types: [\"") + type + "\"]"),
              std::string("t.yaml:3:3: error: device 'd': '") + type +
                  "' in 'types' is no type code: two hex digits, in quotes, as \"08\"\n");
  }
}

TEST(DeviceChecks, DconFindsAPointBeyondTheChannels) {
  EXPECT_EQ(
      ProblemsOf("dcon", "channels: 2, points: [{ name: third, read: \"#[2]\", type: float32 }]"),
      "t.yaml:3:3: error: device 'd': point 'third' reads '#[2]', but 'channels: 2' ends at "
      "[1]\n");
  EXPECT_EQ(
      ProblemsOf("dcon", "channels: 3, points: [{ name: third, read: \"#[2]\", type: float32 }]"),
      "");
  EXPECT_EQ(
      ProblemsOf(
          "dcon",
          "identify: true, channels: 2, points: [{ name: other, read: \"#2\", type: float32 }]"),
      "")
      << "one channel by its own command";
}

/// One line with two devices.
std::string ProblemsOfTwo(const std::string& line, const std::string& first,
                          const std::string& second) {
  const std::string points = ", enabled: false, points: [] }";
  return Shown(config::LoadText("lines:\n- { name: l, port: /dev/l, " + line +
                                    ", devices: [\n  { name: d, " + first + points +
                                    ",\n  { name: e, " + second + points + "] }\n",
                                "t.yaml", Shipped())
                   .problems);
}

TEST(DeviceChecks, OneAddressInAnySpelling) {
  const struct {
    const char* protocol;
    const char* first;
    const char* second;
  } kCases[] = {
      {"dcon", "16", "0x10"},
      {"dcon", "74", "0x4A"},
      {"modbus_rtu", "16", "0x10"},
      {"modbus_ascii", "1", "0x1"},
      {"set4tm", "9020001", "sn:9020001"},
      {"set4tm", "sn:1000", "1000"},
  };
  for (const auto& one : kCases) {
    const auto problems = [&](const std::string& second) {
      return ProblemsOfTwo(std::string("protocol: ") + one.protocol,
                           std::string("address: ") + one.first, "address: " + second);
    };
    EXPECT_EQ(problems(one.second),
              std::string("t.yaml:4:23: warning: address: '") + one.second +
                  "' is also the address of device 'd' on this line, which writes it '" +
                  one.first + "'\n")
        << one.protocol;
    EXPECT_EQ(problems("2"), "") << one.protocol;
  }
  EXPECT_EQ(ProblemsOfTwo("protocol: set4tm", "address: 7", "address: \"sn:7\""), "");
}

TEST(DeviceChecks, WarnsOfAddressesThatAreHardlyMeant) {
  EXPECT_EQ(ProblemsOfTwo("protocol: spabus", "address: 1", "address: 901"),
            "t.yaml:4:23: warning: device 'e': address 901 lies beyond the broadcast number 900, "
            "which no known device can have; write the number that the device shows, 1 to 899\n");
  EXPECT_EQ(ProblemsOfTwo("protocol: spabus", "address: 1", "address: 899"), "");
  EXPECT_EQ(ProblemsOfTwo("protocol: dcon", "address: 1", "address: 0x00"),
            "t.yaml:4:23: warning: device 'e': address 0 is also the address of every module that "
            "is started with INIT* grounded: such a module would answer in place of this one; give "
            "this module another address, 1 to 255\n");
}

TEST(DeviceChecks, WarnsOfARelaysOutputsThatCanBeWritten) {
  EXPECT_EQ(
      ProblemsOf(
          "spabus",
          "profile: spaj140c, write: [output_trip], points: [{ name: output_trip, access: rw }]"),
      "t.yaml:3:76: warning: device 'd': point 'output_trip' can be written: O13 is an output of a "
      "protection relay, and whoever may write to it may trip a breaker; name only the needed "
      "points in `write` of the device, and set permit: read at listeners that need not write\n");
  EXPECT_EQ(ProblemsOf("spabus", "profile: spaj140c"), "") << "its own rows are no doubt";
}

TEST(DeviceChecks, BinaryProtocolsNeedEightDataBits) {
  const auto problems = [](const std::string& line, const std::string& second = "address: 2") {
    return ProblemsOfTwo(line, "address: 1", second);
  };
  EXPECT_EQ(problems("protocol: modbus_rtu, serial: 19200 7E1"),
            "t.yaml:2:58: error: serial: modbus_rtu needs 8 data bits, and 19200 7E1 has 7; write "
            "for example 19200 8E1\n");
  EXPECT_EQ(problems("protocol: set4tm, serial: 9600 7N1"),
            "t.yaml:2:54: error: serial: set4tm needs 8 data bits, and 9600 7N1 has 7; write for "
            "example 9600 8N1\n");
  EXPECT_EQ(problems("protocol: spabus", "address: 2, protocol: modbus_rtu"),
            "t.yaml:4:36: error: serial: modbus_rtu needs 8 data bits, and 9600 7E1 has 7; write "
            "for example 9600 8E1\n");
  EXPECT_EQ(problems("protocol: modbus_rtu", "address: 2, serial: 9600 7O1"),
            "t.yaml:4:34: error: serial: modbus_rtu needs 8 data bits, and 9600 7O1 has 7; write "
            "for example 9600 8O1\n");
  for (const char* const ascii : {"spabus", "dcon", "modbus_ascii"}) {
    EXPECT_EQ(problems(std::string("protocol: ") + ascii + ", serial: 9600 7E1"), "") << ascii;
  }
  const auto listener = config::LoadText(
      "modbus: { listen: { at: /dev/m, serial: 9600 7E1 }, routes: [{ units: 1, line: l }] }\n"
      "lines: [{ name: l, port: /dev/l, protocol: modbus_ascii, serial: 9600 7E1 }]\n",
      "t.yaml", Shipped());
  EXPECT_EQ(Shown(listener.problems),
            "t.yaml:1:41: error: serial: modbus_rtu needs 8 data bits, and 9600 7E1 has 7; write "
            "for example 9600 8E1\n");
}

TEST(DeviceChecks, OfModbusTcpSeveralLinesMayNameOneServer) {
  const auto problems = [](const std::string& one, const std::string& other) {
    return Shown(
        config::LoadText("lines:\n- { name: l, " + one + " }\n- { name: m, " + other + " }\n",
                         "t.yaml", Shipped())
            .problems);
  };
  const std::string at = "port: \"tcp://10.0.0.5:502\", protocol: ";
  const std::string taken = "port: 'tcp://10.0.0.5:502' is already the port of line 'l'";
  EXPECT_THAT(problems(at + "modbus_tcp", at + "modbus_tcp"), Not(HasSubstr("error")));
  EXPECT_THAT(problems(at + "modbus_rtu", at + "modbus_rtu"), HasSubstr(taken));
  EXPECT_THAT(problems(at + "modbus_tcp", at + "modbus_rtu"), HasSubstr(taken));
  EXPECT_THAT(problems(at + "modbus_rtu", at + "modbus_tcp"), HasSubstr(taken));
  EXPECT_THAT(problems(at + "spabus", at + "spabus"), HasSubstr(taken));
}

TEST(DeviceChecks, ARouteToAModbusTcpServerNeedsNoLine) {
  const auto loaded = config::LoadText(
      "modbus: { routes: [{ units: 50, line: l }] }\n"
      "lines: [{ name: l, port: \"tcp://10.0.0.5:502\", protocol: modbus_tcp }]\n",
      "t.yaml", Shipped());
  EXPECT_THAT(
      Shown(loaded.problems),
      HasSubstr("t.yaml:1:39: error: line: 'l' is a Modbus TCP server, which needs no line to "
                "be routed to; write server: \"10.0.0.5:502\" in place of line"));
}

TEST(DeviceChecks, ModbusTcpHasNoSerialLine) {
  const auto problems = [](const std::string& line, const std::string& device = "address: 255") {
    return Shown(config::LoadText("lines:\n- { name: l, " + line + ", devices: [\n  { name: d, " +
                                      device + ", enabled: false, points: [] }] }\n",
                                  "t.yaml", Shipped())
                     .problems);
  };
  EXPECT_EQ(problems("protocol: modbus_tcp, port: \"tcp://10.0.0.5:502\""), "");
  EXPECT_EQ(problems("protocol: modbus_tcp, port: /dev/l"),
            "t.yaml:2:42: error: port: /dev/l is a serial port, and modbus_tcp is spoken over TCP; "
            "write port: tcp://host:502, or protocol: modbus_rtu for a serial line\n");
  EXPECT_EQ(problems("protocol: modbus_tcp, port: \"tcp://10.0.0.5:502\", serial: 9600 8N1, "
                     "echo: strip"),
            "t.yaml:2:72: error: serial: modbus_tcp has no serial line; remove the key\n"
            "t.yaml:2:88: error: echo: modbus_tcp has no serial line; remove the key\n");
  EXPECT_EQ(problems("protocol: modbus_tcp, port: \"tcp://10.0.0.5:502\"",
                     "address: 1, protocol: modbus_rtu"),
            "t.yaml:3:36: error: protocol: modbus_rtu cannot share a line with modbus_tcp; give it "
            "a line of its own\n");
  EXPECT_EQ(problems("protocol: modbus_rtu, port: /dev/l", "address: 1, protocol: modbus_tcp"),
            "t.yaml:3:36: error: protocol: modbus_tcp cannot share a line with modbus_rtu; give it "
            "a line of its own\n");
}

/// "#2" is answered by one number, and so is every other read of it.
TEST(CheckOrder, NamesADeviceOfWhichNothingProvesWhoseReplyItIs) {
  const std::string points = "points: [{ name: one, read: \"#2\", type: float32 }]";
  EXPECT_EQ(ProblemsOf("dcon", "identify: false, " + points),
            "t.yaml:3:3: warning: device 'd': its replies do not show which request they answer, "
            "so after "
            "a lost reply its values are in doubt for some exchanges, which take line time; set "
            "identify: true if it tells its name, or trust_order: true where no serial server or "
            "radio can hold "
            "replies back\n");
  EXPECT_EQ(ProblemsOf("dcon", "identify: false, trust_order: true, " + points), "");
  EXPECT_EQ(ProblemsOf("dcon", points), "");
  EXPECT_EQ(
      ProblemsOf(
          "dcon",
          "identify: false, channels: 2, points: [{ name: one, read: \"#[1]\", type: float32 }]"),
      "")
      << "one channel of two is its probe";
  EXPECT_EQ(ProblemsOf("modbus_rtu", "points: [{ name: one, read: \"holding 5\", type: uint16 }]"),
            "");
}

}  // namespace
}  // namespace baudgate::testing
