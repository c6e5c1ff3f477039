// What is wrong with lines and devices: the exact place and sentence of each kind of error.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "config/loader.h"
#include "tests/config/fake_protocol.h"

namespace baudgate::testing {
namespace {

constexpr const char* kDeviceKeys =
    "allowed: name, protocol, address, enabled, trust_order, serial, profile, identity, poll, "
    "slow, "
    "daily, retries, recheck, timing, max_age, dead_age, unit, on_bad, word_order, checksum, "
    "width, ratio, mode, password, pin, pause, tags, points, events, alarms, event_alarms, ratios, "
    "allow_when, write\n";

std::string ProblemsOfLine(const std::string& keys) {
  return Shown(
      Load("lines:\n- { devices: [{ name: d, address: 1, profile: relay }],\n    " + keys + " }\n")
          .problems);
}

TEST(DeviceErrors, UnknownKeyNamesTheNearestAndAllThatAreAllowed) {
  EXPECT_EQ(ProblemsOfDevice("adress: 2"),
            std::string("t.yaml:6:28: error: unknown key 'adress' in device 'd'; did you mean "
                        "'address'? ") +
                kDeviceKeys);
  EXPECT_EQ(
      ProblemsOfDevice("zzzzzzzz: 2"),
      std::string("t.yaml:6:28: error: unknown key 'zzzzzzzz' in device 'd'; ") + kDeviceKeys);
}

TEST(DeviceErrors, ADecimalCommaBetweenBraces) {
  const std::string problems = ProblemsOfDevice("poll: 1,5s");
  EXPECT_NE(problems.find("a number stands alone behind 'poll' in device 'd'; decimals have a "
                          "point, not a comma: 1.5s"),
            std::string::npos)
      << problems;
  EXPECT_EQ(problems.find("unknown key"), std::string::npos) << problems;
}

TEST(LineErrors, ALineWhoseProtocolIsMisspeltIsCheckedAsTheOneThatIsMeant) {
  const std::string rest =
      ", port: /dev/l, serial: 9600 8N1,\n"
      "    devices: [{ name: d, address: 7x, profile: relay, write: [setting], identity: ignore,\n"
      "                ratios: { V: 400 V }, checksum: on, unit: 3 },\n"
      "              { name: e, address: 2, write: [b],\n"
      "                points: [{ name: a, read: A1, type: int16, write: A1, access: rw },\n"
      "                         { name: b, read: A2, type: int16, write: A2, access: rw }] }] }\n"
      "history: { points: [\"l.d.current_*\"] }\n"
      "modbus: { routes: [{ units: 20, line: l }] }\n";
  const std::string misspelt =
      "t.yaml:2:24: error: protocol: 'FAKE' is not installed; did you mean 'fake'? "
      "installed: fake, other\n";
  EXPECT_EQ(Shown(Load("lines:\n- { name: l, protocol: FAKE" + rest).problems),
            misspelt + Shown(Load("lines:\n- { name: l, protocol: fake" + rest).problems));
  EXPECT_NE(Shown(Load("lines:\n- { name: l, protocol: fake" + rest).problems), "");
  EXPECT_EQ(Shown(Load("lines:\n- { name: l, protocol: telex" + rest).problems),
            "t.yaml:2:24: error: protocol: 'telex' is not installed; installed: fake, other\n")
      << "nobody knows what the rest would mean";
}

TEST(LineErrors, MergeKeysAreNotSupported) {
  EXPECT_EQ(Shown(Load("lines:\n"
                       "- &common { name: b1, port: /dev/a, protocol: fake,\n"
                       "    devices: [{ name: d, address: 1, profile: relay }] }\n"
                       "- { <<: *common, name: b2 }\n")
                      .problems),
            "t.yaml:4:3: warning: line 'b2' has no devices, and no route leads to it: nothing is "
            "asked on it\n"
            "t.yaml:4:5: error: line: '<<' (merge) is not supported; write its keys out\n");
}

TEST(DeviceErrors, DuplicateKey) {
  EXPECT_EQ(ProblemsOfDevice("poll: 1s, poll: 2s"),
            "t.yaml:6:38: error: key 'poll' stands twice in device; first in line 6\n");
}

TEST(DeviceErrors, OneSentenceEach) {
  const Case kCases[] = {
      {"unit: 300", "34: error: unit: '300' is out of range; allowed: 1…247"},
      {"unit: 010",
       "34: error: unit: '010' has a leading zero: it is 10 in YAML 1.2, and 8 in YAML 1.1; write "
       "10 or 8"},
      {"unit: one", "34: error: unit: 'one' is not a whole number; allowed: 1…247"},
      {"unit: [1]", "34: error: unit: expected a single value, found a list"},
      {"unit: ~", "28: error: unit: has no value; give it one or remove the key"},
      {"poll: 500", "34: error: poll: '500' has no unit; write for example 500ms or 500s"},
      {"poll: \"1,5s\"", "34: error: poll: '1,5s' has a decimal comma; write 1.5s"},
      {"poll: 1ms", "34: error: poll: '1ms' is out of range; allowed: 5ms…1d"},
      {"enabled: maybe", "37: error: enabled: 'maybe' is neither true nor false"},
      {"on_bad: nam",
       "36: error: on_bad: 'nam' is unknown; did you mean 'nan'? allowed: "
       "exception, hold, nan"},
      {"word_order: cdab",
       "40: error: word_order: 'cdab' is unknown; did you mean 'CDAB'? "
       "allowed: ABCD, CDAB, BADC, DCBA"},
      {"retries: 11", "37: error: retries: '11' is out of range; allowed: 0…10"},
      {"timing: { replay: 1s }",
       "38: error: unknown key 'replay' in timing; did you mean 'reply'? "
       "allowed: quiet, reply, gap, ceiling, drain"},
      {"timing: { reply: 0ms }", "45: error: reply: '0ms' is out of range; allowed: 1ms…10min"},
      {"timing: { reply: 2s, ceiling: 1s }",
       "58: error: timing: ceiling 1s is shorter than reply 2s; it covers the whole exchange"},
      {"timing: fast", "36: error: timing: expected a map (key: value), found a single value"},
      {"max_age: 500ms",
       "37: error: max_age: 500ms is shorter than poll (1s): every value would "
       "be stale"},
      {"max_age: 5s, dead_age: 4s", "51: error: dead_age: 4s is shorter than max_age (5s)"},
      {"serial: 9600",
       "36: error: serial: '9600' is not speed and character form; write for "
       "example 9600 8N1"},
      {"serial: 99 8N1", "36: error: serial: 99 baud is out of range; allowed: 300…921600"},
      {"serial: { baud: 9600, parity: evn }",
       "58: error: parity: 'evn' is unknown; did you mean 'even'? allowed: none, even, odd, mark, "
       "space, N, E, O, M, S, software"},
      {"protocol: fakt",
       "38: error: protocol: 'fakt' is not installed; did you mean 'fake'? "
       "installed: fake, other"},
      {"profile: relai",
       "37: error: profile: 'relai' is not installed for fake; did you mean 'relay'? installed: "
       "broken, relay (searched tests/config/nowhere/fake, tests/config/profiles/fake)"},
      {"profile: ./none.yaml", "37: error: profile: there is no file ./none.yaml"},
      {"profile: /dev/null", "37: error: profile: /dev/null is no regular file"},
      {"checksum: 2", "38: error: checksum: '2' is neither true nor false"},
      {"width: 99", "35: error: width: '99' is out of range; allowed: 1…20"},
      {"ratio: much", "35: error: ratio: 'much' is not a decimal number"},
      {"mode: quick", "34: error: mode: 'quick' is unknown; allowed: fast, slow, careful"},
      {"pause: 5", "35: error: pause: '5' has no unit; write for example 5ms or 5s"},
      {"pin: 12345", "33: error: pin: the value is out of range; allowed: 0…9999"},
      {"pin: 12E45", "33: error: pin: the value is not a whole number"},
      {"password: [a]", "38: error: password: expected a single value, found a list"},
      {"broadcast: true", "28: error: 'broadcast' belongs to the line, not to its devices"},
  };
  for (const Case& one : kCases) {
    const std::string problems = ProblemsOfDevice(one.keys);
    const std::string expected = "t.yaml:6:" + std::string(one.problem) + "\n";
    EXPECT_EQ(problems, expected) << one.keys;
  }
}

TEST(DeviceErrors, AddressIsCheckedByTheProtocolAtItsPlace) {
  const auto loaded = Load(
      "lines:\n- { name: l, port: /dev/l, protocol: fake,\n"
      "    devices: [{ name: d, address: 0x10, profile: relay }] }\n");
  EXPECT_EQ(Shown(loaded.problems),
            "t.yaml:3:35: error: address: '0x10' is no address; allowed: 1…99\n");
}

TEST(DeviceErrors, WholeDeviceIsCheckedByTheProtocol) {
  EXPECT_EQ(ProblemsOfDevice("mode: slow, width: 20"),
            "t.yaml:6:5: error: device 'd': mode slow has no room for width 20\n");
  EXPECT_EQ(ProblemsOfDevice("mode: slow, width: 19"), "");
}

TEST(DeviceErrors, MissingKeys) {
  const auto loaded = Load("lines:\n- { name: l, port: /dev/l, protocol: fake, devices: [{}] }\n");
  EXPECT_EQ(Shown(loaded.problems),
            "t.yaml:2:54: error: device needs 'name'; for example name: feeder-1\n"
            "t.yaml:2:54: error: device needs 'address'; for example address: 1\n"
            "t.yaml:2:54: warning: device has no points: nothing will be read from it; give it a "
            "profile or points\n");
}

TEST(DeviceErrors, PointsThatAreReadMoreSeldomThanMaxAgeAreAWarning) {
  EXPECT_EQ(ProblemsOfDevice("profile: relay, max_age: 5s"),
            "t.yaml:6:53: warning: max_age: 5s is shorter than slow (2min): slow points will "
            "often be uncertain\n");
  const auto with = [](const std::string& point) {
    return Shown(Load("lines:\n- { name: l, port: /dev/l, protocol: fake,\n"
                      "    devices: [{ name: d, address: 1, max_age: 5s,\n"
                      "      points: [{ name: x, read: A1, type: int16, " +
                      point + " }] }] }\n")
                     .problems);
  };
  EXPECT_EQ(with("poll: 30s"),
            "t.yaml:3:47: warning: max_age: 5s is shorter than poll of point 'x' (30s): it will "
            "often be uncertain\n");
  EXPECT_EQ(with("poll: 5s"), "");
  EXPECT_EQ(with("group: daily"), "") << "it has a limit of its own";
}

TEST(LineErrors, OneSentenceEach) {
  const Case kCases[] = {
      {"name: a b, port: /dev/l, protocol: fake",
       "3:11: error: name: 'a b' is no name; use letters, digits and single '-' or '_' between "
       "them"},
      {"name: a--b, port: /dev/l, protocol: fake",
       "3:11: error: name: 'a--b' is no name; use letters, digits and single '-' or '_' between "
       "them"},
      {"name: l, port: COM1, protocol: fake",
       "3:20: error: port: 'COM1' is neither a path like /dev/ttyUSB0 nor tcp://host:port"},
      {"name: l, port: \"tcp://host\", protocol: fake",
       "3:20: error: port: 'tcp://host' is not tcp://host:port; write for example "
       "tcp://10.0.0.5:4001"},
      {"name: l, port: \"tcp://host:0\", protocol: fake",
       "3:20: error: port: 'tcp://host:0' is not tcp://host:port; write for example "
       "tcp://10.0.0.5:4001"},
      {"name: l, port: /dev/l, protocol: modbus_rtu",
       "3:38: error: protocol: 'modbus_rtu' is not installed; installed: fake, other"},
      {"name: l, port: /dev/l, protocol: fake, echo: on",
       "3:50: error: echo: 'on' is unknown; allowed: off, strip, verify"},
      {"name: l, port: /dev/l, protocol: fake, checksum: true",
       "3:44: error: 'checksum' belongs to the devices, not to the line"},
      {"name: l, port: /dev/l, protocol: fake, serial: 9600 8E1, parity: software",
       "3:70: error: parity: software parity is made inside 8N1 and needs 7E1 or 7O1, not 8E1"},
      {"name: l, port: /dev/l, protocol: fake, rs485: { delay_before_send: 1500us }",
       "3:72: error: delay_before_send: the driver knows whole milliseconds only"},
      {"name: l, port: \"tcp://h:4001\", protocol: fake, rs485: { delay_after_send: 1ms }",
       "3:59: error: rs485: a serial server (tcp://) does this by itself; set it there and remove "
       "the key"},
      {"name: l, port: \"tcp://h:4001\", protocol: fake, serial: { rtscts: true }",
       "3:60: error: rtscts: a serial server (tcp://) does this by itself; set it there and remove "
       "the key"},
      {"name: l, port: /dev/l, protocol: fake, serial: 9600 7N1, parity: even",
       "3:70: error: parity: 'even' belongs to the serial settings; write for example serial: 9600 "
       "7E1 (this key says who makes the parity: hardware or software)"},
      {"name: l, protocol: fake",
       "2:3: error: line 'l' needs 'port'; for example port: "
       "/dev/ttyUSB0"},
  };
  for (const Case& one : kCases) {
    EXPECT_EQ(ProblemsOfLine(one.keys), "t.yaml:" + std::string(one.problem) + "\n") << one.keys;
  }
}

TEST(LineErrors, WithoutDevicesIsAWarning) {
  const auto loaded = Load("lines:\n- { name: l, port: /dev/l, protocol: fake }\n");
  EXPECT_TRUE(loaded.ok());
  EXPECT_EQ(Shown(loaded.problems),
            "t.yaml:2:3: warning: line 'l' has no devices, and no route leads to it: nothing is "
            "asked on it\n");
}

TEST(GatewayErrors, NamesUnitsAndPortsAreUnique) {
  const auto loaded = Load(
      "lines:\n"
      "- name: l\n"
      "  port: /dev/l\n"
      "  protocol: fake\n"
      "  devices:\n"
      "  - { name: d, address: 1, unit: 4, profile: relay }\n"
      "  - { name: e, address: 1, unit: 5, profile: relay }\n"
      "- name: l\n"
      "  port: /dev/../dev/l\n"
      "  protocol: fake\n"
      "  devices:\n"
      "  - { name: d, address: 1, unit: 4, profile: relay }\n");
  EXPECT_EQ(Shown(loaded.problems),
            "t.yaml:7:25: warning: address: '1' is also the address of device 'd' on this line\n"
            "t.yaml:8:9: error: line name 'l' is taken; first in line 2 of the file\n"
            "t.yaml:9:9: error: port: '/dev/../dev/l' is already the port of line 'l'; put the "
            "devices on one line\n"
            "t.yaml:12:13: error: device name 'd' is taken; first in line 6 of the file\n"
            "t.yaml:12:34: error: unit: 4 is taken by device 'd' (line 6)\n");
}

TEST(GatewayErrors, OneSerialServerInAnySpelling) {
  const auto loaded = Load(
      "lines:\n"
      "- name: l\n"
      "  port: tcp://Gate:4001\n"
      "  protocol: fake\n"
      "  devices: [{ name: d, address: 1, profile: relay }]\n"
      "- name: m\n"
      "  port: tcp://gATE:4001\n"
      "  protocol: fake\n"
      "  devices: [{ name: e, address: 1, profile: relay }]\n");
  EXPECT_EQ(Shown(loaded.problems),
            "t.yaml:7:9: error: port: 'tcp://gATE:4001' is already the port of line 'l'; put the "
            "devices on one line\n");
}

TEST(GatewayErrors, OneAddressInAnySpelling) {
  const auto loaded = Load(
      "lines:\n"
      "- name: l\n"
      "  port: /dev/l\n"
      "  protocol: fake\n"
      "  devices:\n"
      "  - { name: d, address: 1, profile: relay }\n"
      "  - { name: e, address: +1, profile: relay }\n"
      "  - { name: f, address: 1, enabled: false, points: [], protocol: other }\n");
  EXPECT_EQ(Shown(loaded.problems),
            "t.yaml:7:25: warning: address: '+1' is also the address of device 'd' on this line, "
            "which writes it '1'\n");
}

TEST(GatewayErrors, EverythingAtOnceInTheOrderOfTheFile) {
  const auto loaded = Load(
      "gatewai: { name: x }\n"
      "modbus: { listen: here }\n"
      "dds: { domain: 233 }\n"
      "lines:\n"
      "- name: l\n"
      "  port: /dev/l\n"
      "  protocol: fake\n"
      "  retries: many\n"
      "  devices:\n"
      "  - { name: d, address: 100, poll: 1, points: [{ name: p, read: B1, type: real }] }\n"
      "  - { name: e, address: 2, profile: broken }\n");
  EXPECT_FALSE(loaded.ok());
  EXPECT_EQ(Shown(loaded.problems),
            "t.yaml:1:1: error: unknown key 'gatewai' in the configuration; did you mean "
            "'gateway'? allowed: gateway, events, history, modbus, dds, web, lines\n"
            "t.yaml:2:19: error: listen: 'here' is not host:port; write for example "
            "127.0.0.1:1502, or /dev/ttyUSB4\n"
            "t.yaml:3:16: error: domain: '233' is out of range; allowed: 0…232\n"
            "t.yaml:8:12: error: retries: 'many' is not a whole number; allowed: 0…10\n"
            "t.yaml:10:25: error: address: '100' is no address; allowed: 1…99\n"
            "t.yaml:10:36: error: poll: '1' has no unit; write for example 1ms or 1s\n"
            "t.yaml:10:65: error: point 'p': read 'B1' is not understood; write A and a number\n"
            "t.yaml:10:75: error: type: 'real' is unknown; did you mean 'REAL'?\n"
            "t.yaml:11:37: error: profile: 'broken' of device 'e' has errors; see "
            "tests/config/profiles/fake/broken.yaml\n"
            "tests/config/profiles/fake/broken.yaml:3:22: error: point 'a': read 'X1' is not "
            "understood; write A and a number\n"
            "tests/config/profiles/fake/broken.yaml:4:32: error: type: 'float33' is unknown; did "
            "you mean 'float32'? allowed: bool, int8, uint8, int16, uint16, int32, uint32, int64, "
            "uint64, float32, float64, string(n), or a type of IEC 61131-3 such as REAL\n");
}

TEST(GatewayErrors, AProfileIsJudgedOnceHoweverItsPathIsWritten) {
  const std::string devices =
      "lines:\n"
      "- name: l\n"
      "  port: /dev/l\n"
      "  protocol: fake\n"
      "  devices:\n";
  const std::string one =
      Shown(Load(devices +
                 "  - { name: d, address: 1, profile: tests/config/profiles/fake/broken.yaml }\n")
                .problems);
  const std::string both =
      Shown(Load(devices +
                 "  - { name: d, address: 1, profile: tests/config/profiles/fake/broken.yaml }\n"
                 "  - { name: e, address: 2, profile: tests/config/./profiles/fake/broken.yaml }\n"
                 "  - { name: f, address: 3, profile: broken }\n")
                .problems);
  EXPECT_EQ(one, both);
  EXPECT_NE(one.find("t.yaml:6:37: error: profile: 'broken' of device 'd' has errors"),
            std::string::npos)
      << one;
}

TEST(GatewayErrors, LinesAreNeeded) {
  EXPECT_EQ(Shown(Load("gateway: { name: x }\n").problems),
            "t.yaml:1:1: error: the configuration needs 'lines'; for example lines: [ { name: "
            "bay-1, port: /dev/ttyUSB0, … } ]\n");
}

}  // namespace
}  // namespace baudgate::testing
