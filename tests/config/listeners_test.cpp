// Every key of a listener, at a TCP port and at a serial one, and what is refused or warned of.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "config/loader.h"
#include "config/model/network.h"
#include "tests/config/fake_protocol.h"

namespace baudgate::testing {
namespace {

using config::Listener;
using config::Permit;
using config::Priority;

constexpr const char* kDrive =
    "lines:\n"
    "- { name: drive, port: /dev/l, protocol: modbus_rtu, devices: [{ name: d, address: 1, "
    "points: [{ name: p, read: A1, type: int16 }] }] }\n";

/// The keys stand in line 1 from column 21 on.
config::Loaded LoadListener(const std::string& keys) {
  return LoadModbus("modbus: { listen: { " + keys + " } }\n" + kDrive);
}

std::string ProblemsOfListener(const std::string& keys) {
  return Shown(LoadListener(keys).problems);
}

Listener ListenerOf(const std::string& keys) {
  const auto loaded = LoadListener(keys);
  EXPECT_EQ(Shown(loaded.problems), "") << keys;
  return loaded.config.modbus.listen.at(0);
}

TEST(Listeners, Defaults) {
  const Listener listener = ListenerOf("at: \"127.0.0.1:1502\"");
  EXPECT_FALSE(listener.is_serial());
  EXPECT_EQ(listener.Address(), "127.0.0.1:1502");
  EXPECT_EQ(listener.framing, modbus::Framing::tcp);
  EXPECT_EQ(listener.permit, Permit::all);
  EXPECT_EQ(listener.priority, Priority::normal);
  EXPECT_EQ(listener.errors, Listener::Errors::exception);
  EXPECT_EQ(listener.broadcast, Listener::Broadcast::ignore);
  EXPECT_TRUE(listener.allow.empty() && listener.clients.empty() && listener.functions.empty());
}

TEST(Listeners, RtuOverTcp) {
  const Listener listener = ListenerOf("at: \"0.0.0.0:2101\", framing: rtu, errors: silent");
  EXPECT_EQ(listener.framing, modbus::Framing::rtu);
  EXPECT_EQ(listener.errors, Listener::Errors::silent);
  EXPECT_EQ(ListenerOf("framing: rtu").errors, Listener::Errors::exception);
}

TEST(Listeners, Holes) {
  EXPECT_EQ(ListenerOf("permit: all").holes, Listener::Holes::off);
  EXPECT_EQ(ListenerOf("holes: zero").holes, Listener::Holes::zero);
  EXPECT_EQ(ListenerOf("at: /dev/ttyUSB4, holes: zero").holes, Listener::Holes::zero);
}

TEST(Listeners, Permission) {
  EXPECT_EQ(ListenerOf("permit: read").permit, Permit::read);
  EXPECT_EQ(ListenerOf("permit: data").permit, Permit::data);
  EXPECT_EQ(ListenerOf("permit: all").permit, Permit::all);
  EXPECT_EQ(ListenerOf("write: deny").permit, Permit::read);
  EXPECT_EQ(ListenerOf("write: allow").permit, Permit::all);
  EXPECT_EQ(ListenerOf("write: allow, permit: data").permit, Permit::data);
  EXPECT_EQ(ListenerOf("write: deny, permit: read").permit, Permit::read);
}

TEST(Listeners, PriorityRules) {
  const Listener listener = ListenerOf(
      "priority: low, clients: [{ from: 10.0.0.7, priority: high }, { from: 10.0.0.0/8, "
      "priority: normal }], functions: [{ codes: [5, 6, 15, 16], priority: high }, { codes: "
      "127, priority: low }]");
  EXPECT_EQ(listener.priority, Priority::low);
  ASSERT_EQ(listener.clients.size(), 2U);
  EXPECT_EQ(listener.clients[0].from.text, "10.0.0.7");
  EXPECT_EQ(listener.clients[0].from.prefix, 128);
  EXPECT_EQ(listener.clients[0].priority, Priority::high);
  EXPECT_EQ(listener.clients[1].priority, Priority::normal);
  ASSERT_EQ(listener.functions.size(), 2U);
  EXPECT_EQ(listener.functions[0].codes, (std::vector<std::uint8_t>{5, 6, 15, 16}));
  EXPECT_EQ(listener.functions[0].priority, Priority::high);
  EXPECT_EQ(listener.functions[1].codes, (std::vector<std::uint8_t>{127}));
}

TEST(Listeners, SerialPort) {
  const Listener listener = ListenerOf(
      "at: /dev/ttyUSB4, serial: 38400 7O1, parity: software, rs485: { delay_after_send: 1ms "
      "}, permit: data, priority: high, functions: [{ codes: [6], priority: low }]");
  EXPECT_TRUE(listener.is_serial());
  EXPECT_EQ(listener.Address(), "/dev/ttyUSB4");
  EXPECT_EQ(listener.serial.ToString(), "38400 7O1");
  EXPECT_TRUE(listener.serial.software_parity);
  EXPECT_TRUE(listener.serial.rs485.enabled);
  EXPECT_EQ(listener.framing, modbus::Framing::rtu);
  EXPECT_EQ(listener.errors, Listener::Errors::silent);
  EXPECT_EQ(listener.permit, Permit::data);
  EXPECT_EQ(ListenerOf("at: /dev/ttyUSB4, errors: exception, framing: rtu").errors,
            Listener::Errors::exception);
}

TEST(Listeners, Echo) {
  EXPECT_EQ(ListenerOf("at: /dev/ttyUSB4").echo, Listener::Echo::off);
  EXPECT_EQ(ListenerOf("at: /dev/ttyUSB4, echo: off").echo, Listener::Echo::off);
  EXPECT_EQ(ListenerOf("at: /dev/ttyUSB4, echo: strip").echo, Listener::Echo::strip);
}

TEST(Listeners, SerialPortAsTextHasTheSettingsOfTheProtocol) {
  const auto loaded = LoadModbus(std::string("modbus: { listen: [/dev/ttyUSB4] }\n") + kDrive);
  ASSERT_EQ(Shown(loaded.problems), "");
  EXPECT_EQ(loaded.config.modbus.listen.at(0).path, "/dev/ttyUSB4");
  EXPECT_EQ(loaded.config.modbus.listen.at(0).serial.ToString(), "19200 8E1");
  EXPECT_EQ(loaded.config.modbus.listen.at(0).errors, Listener::Errors::silent);
}

TEST(Listeners, Broadcast) {
  const std::string with_route =
      "modbus: { listen: { broadcast: pass }, routes: [{ units: 20, line: drive }] }\n";
  const auto loaded = LoadModbus(with_route + kDrive);
  EXPECT_EQ(Shown(loaded.problems), "");
  EXPECT_EQ(loaded.config.modbus.listen.at(0).broadcast, Listener::Broadcast::pass);
  EXPECT_EQ(ListenerOf("broadcast: ignore").broadcast, Listener::Broadcast::ignore);
  EXPECT_EQ(ProblemsOfListener("broadcast: pass"),
            "t.yaml:1:19: warning: listen: broadcast: pass has no effect: no route leads to a "
            "line, and none names unit 0\n");
  const auto to_server = [](const std::string& route) {
    return Shown(LoadModbus("modbus: { listen: { broadcast: pass }, routes: [{ " + route +
                            ", server: plc }] }\n")
                     .problems);
  };
  EXPECT_EQ(to_server("units: 0-5"), "") << "writes to unit 0 go to the server's unit 0";
  EXPECT_NE(to_server("units: 0, remap: 1"), "");
  EXPECT_NE(to_server("units: 20"), "");
}

TEST(Listeners, OneSentenceEach) {
  const struct {
    const char* keys;
    const char* problem;
  } kCases[] = {
      {"at: ttyUSB4",
       "25: error: at: 'ttyUSB4' is not host:port; write for example 127.0.0.1:1502, or "
       "/dev/ttyUSB4"},
      {"at: \"10.0.0.1:0\"",
       "25: error: at: '10.0.0.1:0' has no usable port number; allowed: 1…65535"},
      {"framing: udp", "30: error: framing: 'udp' is unknown; allowed: tcp, rtu, ascii"},
      {"permit: write", "29: error: permit: 'write' is unknown; allowed: read, data, all"},
      {"write: deny, permit: data",
       "28: error: write: deny contradicts permit: data; remove one of them"},
      {"write: deny, permit: all",
       "28: error: write: deny contradicts permit: all; remove one of them"},
      {"permit: read, write: allow",
       "42: error: write: allow contradicts permit: read; remove one of them"},
      {"priority: hihg",
       "31: error: priority: 'hihg' is unknown; did you mean 'high'? allowed: low, normal, high"},
      {"errors: off", "29: error: errors: 'off' is unknown; allowed: exception, silent"},
      {"broadcast: replace", "32: error: broadcast: 'replace' is unknown; allowed: ignore, pass"},
      {"clients: 10.0.0.7", "30: error: clients: expected a list, found a single value"},
      {"clients: [10.0.0.7]",
       "31: error: an entry of clients: expected a map (key: value), found a single value"},
      {"clients: [{ priority: high }]",
       "31: error: an entry of clients needs 'from'; for example from: 10.0.0.7"},
      {"clients: [{ from: 10.0.0.7 }]",
       "31: error: an entry of clients needs 'priority'; for example priority: high"},
      {"clients: [{ from: plc, priority: high }]",
       "39: error: from: 'plc' is not an address range; write for example 10.0.0.0/8"},
      {"clients: [{ from: 10.0.0.7, priority: top }]",
       "59: error: priority: 'top' is unknown; allowed: low, normal, high"},
      {"clients: [{ from: 10.0.0.7, priority: low, to: 1 }]",
       "64: error: unknown key 'to' in an entry of clients; allowed: from, priority"},
      {"clients: [{ from: 10.0.0.0/8, priority: low }, { from: 10.0.0.7, priority: high }]",
       "76: warning: from: 10.0.0.7 has no effect: 10.0.0.0/8 stands first and covers it"},
      {"allow: 10.0.0.0/8, clients: [{ from: 192.168.0.7, priority: high }], at: \"0.0.0.0:1\"",
       "58: warning: from: 192.168.0.7 has no effect: 'allow' excludes all of these addresses"},
      {"allow: 10.0.0.0/8",
       "19: warning: listen: 127.0.0.1:1502 takes connections from this machine only, and 'allow' "
       "has only others: nobody can come in; write for example at: \"0.0.0.0:1502\""},
      {"at: \"[::1]:502\", allow: 10.0.0.7",
       "19: warning: listen: [::1]:502 takes connections from this machine only, and 'allow' has "
       "only others: nobody can come in; write for example at: \"0.0.0.0:502\""},
      {"functions: [{ codes: [0], priority: high }]",
       "43: error: codes: '0' is out of range; allowed: 1…127"},
      {"functions: [{ codes: 128, priority: high }]",
       "42: error: codes: '128' is out of range; allowed: 1…127"},
      {"functions: [{ codes: [], priority: high }]",
       "42: error: codes: the list is empty; write for example [5, 6, 15, 16]"},
      {"functions: [{ priority: high }]",
       "33: error: an entry of functions needs 'codes'; for example codes: [5, 6, 15, 16]"},
      {"functions: [{ codes: 6 }]",
       "33: error: an entry of functions needs 'priority'; for example priority: high"},
      {"functions: [{ codes: 6, priority: high }, { codes: [5, 6], priority: low }]",
       "76: error: codes: 6 stands twice"},
      {"functions: [6]",
       "33: error: an entry of functions: expected a map (key: value), found a single value"},
      {"serial: 9600 8N1",
       "21: error: serial: only a listener at a serial port has it; write for example at: "
       "/dev/ttyUSB4, or remove the key"},
      {"at: \"127.0.0.1:502\", rs485: {}",
       "42: error: rs485: only a listener at a serial port has it; write for example at: "
       "/dev/ttyUSB4, or remove the key"},
      {"parity: software",
       "21: error: parity: only a listener at a serial port has it; write for example at: "
       "/dev/ttyUSB4, or remove the key"},
      {"at: \"127.0.0.1:502\", echo: strip",
       "42: error: echo: only a listener at a serial port has it; write for example at: "
       "/dev/ttyUSB4, or remove the key"},
      {"at: /dev/m, echo: verify",
       "39: error: echo: verify is for lines, where the gateway asks; a listener answers: write "
       "strip where its adapter hears itself, or off"},
      {"at: /dev/m, echo: stripe",
       "39: error: echo: 'stripe' is unknown; did you mean 'strip'? allowed: off, strip"},
      {"at: /dev/m, framing: tcp",
       "42: error: framing: a master at a serial port speaks rtu or ascii; write one of them, or "
       "remove the key"},
      {"at: /dev/m, serial: 9600",
       "41: error: serial: '9600' is not speed and character form; write for example 9600 8N1"},
      {"at: /dev/m, allow: 10.0.0.0/8",
       "33: error: allow: at a serial port there is one master, always; remove the key"},
      {"at: /dev/m, clients: []",
       "33: error: clients: at a serial port there is one master, always; remove the key"},
      {"at: /dev/m, max_clients: 1",
       "33: error: max_clients: at a serial port there is one master, always; remove the key"},
      {"at: /dev/m, idle_timeout: 1s",
       "33: error: idle_timeout: at a serial port there is one master, always; remove the key"},
      {"at: /dev/../dev/l",
       "19: error: listen: '/dev/../dev/l' is already the port of line 'drive' (line 3); a master "
       "needs a port of its own"},
  };
  for (const auto& one : kCases) {
    EXPECT_EQ(ProblemsOfListener(one.keys), "t.yaml:1:" + std::string(one.problem) + "\n")
        << one.keys;
  }
}

TEST(Listeners, OnePortForTwo) {
  const auto loaded = LoadModbus(
      std::string("modbus: { listen: [/dev/m, { at: /dev/m, priority: high }] }\n") + kDrive);
  EXPECT_EQ(
      Shown(loaded.problems),
      "t.yaml:1:28: error: listen: '/dev/m' is already the port of another listener (line 1); a "
      "master needs a port of its own\n");
}

TEST(Listeners, OnePortOfOneAddress) {
  const auto problems = [](const std::string& first, const std::string& second) {
    return Shown(
        LoadModbus("modbus:\n  listen:\n  - \"" + first + "\"\n  - \"" + second + "\"\n" + kDrive)
            .problems);
  };
  const auto sentence = [](const std::string& first, const std::string& second) {
    return "t.yaml:4:5: error: listen: " + second + " and " + first +
           " in line 3 want the same port; remove one, or give it another port\n";
  };
  for (const auto& [first, second] : {std::pair("127.0.0.1:502", "0.0.0.0:502"),
                                      {"0.0.0.0:502", "10.0.0.7:502"},
                                      {"0.0.0.0:502", "[::]:502"},
                                      {"[::]:502", "127.0.0.1:502"},
                                      {"[::1]:502", "[::]:502"},
                                      {"[::1]:502", "[0::1]:502"}}) {
    EXPECT_EQ(problems(first, second), sentence(first, second));
  }
  EXPECT_EQ(problems("0.0.0.0:502", "0.0.0.0:502"),
            "t.yaml:4:5: error: listen: 0.0.0.0:502 stands twice; first in line 3\n");
  EXPECT_EQ(problems("127.0.0.1:502", "0.0.0.0:503"), "");
  EXPECT_EQ(problems("127.0.0.1:502", "10.0.0.7:502"), "");
  EXPECT_EQ(problems("0.0.0.0:502", "[::1]:502"), "");
}

TEST(Listeners, RtuNeedsItsModule) {
  const auto problems = [](const std::string& listen) {
    return Shown(Load("modbus: { listen: " + listen +
                      " }\nlines:\n- { name: l, port: /dev/l, protocol: fake, devices: [{ name: d, "
                      "address: 1, profile: relay }] }\n")
                     .problems);
  };
  const std::string sentence =
      ": error: listen: rtu needs a protocol that makes Modbus RTU frames, and none is "
      "installed; installed: fake, other\n";
  EXPECT_EQ(problems("{ framing: rtu }"), "t.yaml:1:19" + sentence);
  EXPECT_EQ(problems("{ at: /dev/m }"), "t.yaml:1:19" + sentence);
  EXPECT_EQ(problems("/dev/m"), "t.yaml:1:19" + sentence);
  EXPECT_EQ(problems("{ framing: tcp }"), "");
}

TEST(Network, OneInsideAnother) {
  const auto covers = [](const char* outer, const char* inner) {
    return config::Covers(*config::ParseNetwork(outer), *config::ParseNetwork(inner));
  };
  EXPECT_TRUE(covers("10.0.0.0/8", "10.255.0.1"));
  EXPECT_TRUE(covers("10.0.0.7", "10.0.0.7"));
  EXPECT_FALSE(covers("10.0.0.0/8", "11.0.0.1"));
  EXPECT_FALSE(covers("10.0.0.0", "10.0.0.0/8"));
  EXPECT_FALSE(covers("::1", "10.0.0.7"));
}

TEST(Network, ServersMayLeaveThePortOut) {
  const auto shown = [](const char* text) {
    const auto at = config::ParseServer(text, 502);
    return at ? at->host + " " + std::to_string(at->port) : at.error();
  };
  EXPECT_EQ(shown("10.0.0.9:1502"), "10.0.0.9 1502");
  EXPECT_EQ(shown("10.0.0.9"), "10.0.0.9 502");
  EXPECT_EQ(shown("plc-7"), "plc-7 502");
  EXPECT_EQ(shown("::1"), "::1 502");
  EXPECT_EQ(shown("[::1]"), "::1 502");
  EXPECT_EQ(shown("[::1]:7"), "::1 7");
  EXPECT_EQ(shown("a b"), "'a b' is not a server; write for example 10.0.0.9:502");
  EXPECT_EQ(shown(""), "'' is not a server; write for example 10.0.0.9:502");
  EXPECT_EQ(shown("x:0"), "'x:0' has no usable port number; allowed: 1…65535");
}

}  // namespace
}  // namespace baudgate::testing
