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
