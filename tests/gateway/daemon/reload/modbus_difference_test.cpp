// What a changed configuration does to which listener and which route.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "gateway/daemon/reload/difference.h"

namespace baudgate::reload {
namespace {

using config::Modbus;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

config::Listener ListenerAt(const std::string& host, std::uint16_t port) {
  config::Listener listener;
  listener.host = host;
  listener.port = port;
  return listener;
}

config::Listener MasterAt(const std::string& path) {
  config::Listener listener;
  listener.path = path;
  return listener;
}

config::Route RouteTo(const std::string& line, std::uint8_t first, std::uint8_t last) {
  config::Route route;
  route.first = first;
  route.last = last;
  route.line = line;
  return route;
}

Modbus SampleModbus() {
  Modbus modbus;
  modbus.listen = {ListenerAt("127.0.0.1", 1502), ListenerAt("10.0.0.1", 502),
                   MasterAt("/dev/ttyS1")};
  modbus.routes = {RouteTo("drive", 33, 40), RouteTo("pumps", 41, 41)};
  config::Route elsewhere = RouteTo("", 50, 50);
  elsewhere.host = "10.0.0.9";
  modbus.routes.push_back(elsewhere);
  return modbus;
}

using Change = std::function<void(Modbus&)>;

ModbusDifference After(const Change& change) {
  Modbus next = SampleModbus();
  change(next);
  return CompareModbus(SampleModbus(), next);
}

std::vector<std::string> Sentences(const ModbusDifference& difference) {
  std::vector<std::string> sentences;
  const auto tell = [&sentences](const auto& changes) {
    for (const auto& change : changes) {
      if (change.action != Action::same) sentences.push_back(SentenceOf(change));
    }
  };
  tell(difference.listeners);
  tell(difference.routes);
  return sentences;
}

struct ModbusCase {
  const char* what;
  Change change;
  std::vector<std::string> sentences;
};

TEST(ModbusDifference, IsToldInOneSentenceForEachListener) {
  const ModbusCase cases[] = {
      {"nothing", [](Modbus&) {}, {}},
      {"its place in the file",
       [](Modbus& its) {
         its.listen[0].mark = {"other.yaml", 7, 3};
       },
       {}},
      {"the order", [](Modbus& its) { std::swap(its.listen[0], its.listen[2]); }, {}},
      {"what may be asked",
       [](Modbus& its) { its.listen[0].permit = config::Permit::read; },
       {"listener 127.0.0.1:1502: differs in write; its clients are disconnected"}},
      {"two settings, and another place",
       [](Modbus& its) {
         its.listen[1].allow.push_back({"10.0.0.0/8", {}, 104});
         its.listen[1].max_clients = 7;
         std::swap(its.listen[0], its.listen[1]);
       },
       {"listener 10.0.0.1:502: differs in allow, max_clients; its clients are disconnected"}},
      {"the rate of a serial port",
       [](Modbus& its) { its.listen[2].serial.baud = 1200; },
       {"listener /dev/ttyS1: differs in serial; its clients are disconnected"}},
      {"one more",
       [](Modbus& its) { its.listen.push_back(ListenerAt("10.0.0.2", 502)); },
       {"listener 10.0.0.2:502: is new"}},
      {"one less",
       [](Modbus& its) { its.listen.pop_back(); },
       {"listener /dev/ttyS1: ends; its clients are disconnected"}},
      {"another port",
       [](Modbus& its) { its.listen[1].port = 503; },
       {"listener 10.0.0.1:503: is new",
        "listener 10.0.0.1:502: ends; its clients are disconnected"}},
  };
  for (const ModbusCase& one : cases) {
    const ModbusDifference difference = After(one.change);
    EXPECT_EQ(Sentences(difference), one.sentences) << one.what;
    EXPECT_THAT(difference.restart, IsEmpty()) << one.what;
  }
}

TEST(ModbusDifference, SaysWhereEachListenerWas) {
  const ModbusDifference difference = After([](Modbus& its) {
    its.listen.insert(its.listen.begin(), ListenerAt("10.0.0.2", 502));
    its.listen.erase(its.listen.begin() + 2);
  });
  std::vector<std::optional<std::size_t>> was;
  for (const ListenerChange& listener : difference.listeners) was.push_back(listener.was);
  EXPECT_THAT(was, ElementsAre(std::nullopt, 0U, 2U, 1U)) << "the last is the one that ends";
}

TEST(ModbusDifference, CountsClientsThatAListenerLosesIfItCan) {
  ListenerChange change{"10.0.0.1:502", Action::restarted, "write", 0, 3};
  EXPECT_EQ(SentenceOf(change),
            "listener 10.0.0.1:502: differs in write; its 3 clients are disconnected");
  change.clients = 1;
  EXPECT_EQ(SentenceOf(change),
            "listener 10.0.0.1:502: differs in write; its client is disconnected");
  change.clients = 0;
  EXPECT_EQ(SentenceOf(change), "listener 10.0.0.1:502: differs in write");
}

TEST(ModbusDifference, IsToldInOneSentenceForEachRoute) {
  const ModbusCase cases[] = {
      {"one more",
       [](Modbus& its) { its.routes.insert(its.routes.begin(), RouteTo("drive", 9, 9)); },
       {"route 9 to drive: is new"}},
      {"one less",
       [](Modbus& its) { its.routes.erase(its.routes.begin()); },
       {"route 33-40 to drive: ends"}},
      {"its numbers on the line",
       [](Modbus& its) {
         its.routes[0].remap = 1;
         its.routes[0].deadline = 5s;
       },
       {"route 33-40 to drive: begins anew: remap, deadline"}},
      {"its alarms",
       [](Modbus& its) { its.routes[0].alarms.delay = 5s; },
       {"route 33-40 to drive: goes on, with other alarms"}},
      {"another server",
       [](Modbus& its) { its.routes[2].port = 503; },
       {"route 50 to 10.0.0.9:503: is new", "route 50 to 10.0.0.9:502: ends"}},
      {"the number of its line", [](Modbus& its) { its.routes[0].line_index = 7; }, {}},
      {"one that stands twice",
       [](Modbus& its) { its.routes.push_back(its.routes[0]); },
       {"route 33-40 to drive: is new"}},
  };
  for (const ModbusCase& one : cases) {
    const ModbusDifference difference = After(one.change);
    EXPECT_EQ(Sentences(difference), one.sentences) << one.what;
    EXPECT_FALSE(difference.route_order) << one.what;
  }
}

TEST(ModbusDifference, OfTheOrderOfRoutesIsNoticedForTheFirstWins) {
  const ModbusDifference difference =
      After([](Modbus& its) { std::swap(its.routes[0], its.routes[2]); });
  EXPECT_TRUE(difference.route_order);
  EXPECT_THAT(Sentences(difference), IsEmpty());
  std::vector<std::optional<std::size_t>> was;
  for (const RouteChange& route : difference.routes) was.push_back(route.was);
  EXPECT_THAT(was, ElementsAre(2U, 1U, 0U));
}

TEST(ModbusDifference, PortsThatBlockEachOtherNeedARestart) {
  struct Ports {
    const char* was;
    const char* is;
    bool block;
  };
  const Ports cases[] = {{"10.0.0.1", "0.0.0.0", true},
                         {"0.0.0.0", "10.0.0.1", true},
                         {"10.0.0.1", "10.0.0.2", false},
                         {"10.0.0.1", "::", true},
                         {"::", "0.0.0.0", true},
                         {"::1", "0.0.0.0", false},
                         {"::", "::1", true}};
  for (const Ports& one : cases) {
    Modbus running;
    running.listen = {ListenerAt(one.was, 502)};
    Modbus next;
    next.listen = {ListenerAt(one.is, 502)};
    const auto restart = CompareModbus(running, next).restart;
    EXPECT_EQ(!restart.empty(), one.block) << one.was << " " << one.is;
    next.listen[0].port = 503;
    EXPECT_THAT(CompareModbus(running, next).restart, IsEmpty()) << "another port";
  }
  Modbus running = SampleModbus();
  Modbus next = SampleModbus();
  next.listen[1].host = "0.0.0.0";
  EXPECT_THAT(CompareModbus(running, next).restart,
              ElementsAre("modbus.listen from 10.0.0.1:502 to 0.0.0.0:502"));
}

TEST(ModbusDifference, OfAnOutputThatIsOffIsNone) {
  Modbus off = SampleModbus();
  off.enabled = false;
  EXPECT_THAT(CompareModbus(off, SampleModbus()).listeners, IsEmpty());
  EXPECT_THAT(CompareModbus(SampleModbus(), off).routes, IsEmpty());
}

}  // namespace
}  // namespace baudgate::reload
