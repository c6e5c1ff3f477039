// Tests of a new configuration for a running server.
// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <asio/io_context.hpp>
#include <asio/ip/address.hpp>
#include <asio/post.hpp>
#include <atomic>
#include <cstdlib>
#include <future>
#include <string>
#include <vector>

#include "gateway/outputs/modbus/server/listener.h"
#include "tests/gateway/outputs/modbus/service/route_fixture.h"

namespace baudgate::modbus {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

constexpr const char* kOwn = "03 00 00 00 01";

class RenewalTest : public RouteTest {
 protected:
  void SetUp() override {
    config_.modbus.listen.resize(2, listener());
    next_ = config_;
  }

  static Renewal Same(std::size_t listeners, std::size_t routes) {
    Renewal renewal;
    for (std::size_t i = 0; i < listeners; ++i) renewal.listeners.push_back({i, true});
    for (std::size_t i = 0; i < routes; ++i) renewal.routes.emplace_back(i);
    return renewal;
  }
  void Renew(const Renewal& renewal) {
    std::promise<void> done;
    asio::post(io_, [&] {
      server_->Finish(server_->Apply(next_, links_.lines, renewal));
      done.set_value();
    });
    done.get_future().wait();
  }
  ListenerOrigin Opened(const config::Listener& listener) {
    auto port = server_->OpenPort(listener);
    EXPECT_TRUE(port.ok()) << port.error();
    return {std::nullopt, false, port.ok() ? *port : ListenerPort{}};
  }
  std::string AskOnce(std::uint8_t unit, const std::string& pdu) {
    return Ask(Connect(), unit, pdu);
  }

  config::Config next_;
};

TEST_F(RenewalTest, AClientOfAnUnchangedListenerContinuesWithoutAnError) {
  StartServer();
  std::atomic<bool> stop = false;
  std::atomic<int> read = 0;
  std::atomic<int> failed = 0;
  std::thread reader([&] {
    const RawClient client = Connect();
    while (!stop) {
      if (Ask(client, 1, kOwn) != "03 02 FF FE") ++failed;
      ++read;
      read.notify_all();
    }
  });
  const auto wait_for_a_read = [&] { read.wait(read); };
  wait_for_a_read();
  for (int round = 0; round < 20; ++round) {
    next_.modbus.listen[1].permit = round % 2 == 0 ? config::Permit::read : config::Permit::all;
    Renewal renewal = Same(2, 0);
    renewal.listeners[1].same = false;
    Renew(renewal);
    wait_for_a_read();
    next_.modbus.listen.push_back(next_.modbus.listen[0]);
    renewal = Same(2, 0);
    renewal.listeners.push_back(Opened(next_.modbus.listen[2]));
    Renew(renewal);
    wait_for_a_read();
    next_.modbus.listen.pop_back();
    Renew(Same(2, 0));
  }
  stop = true;
  reader.join();
  EXPECT_EQ(failed, 0) << "of " << read;
  EXPECT_EQ(server_->counters().accepted, 1U);
}

TEST_F(RenewalTest, ClientsOfAChangedListenerAreDisconnectedAndNewOnesGetItsSettings) {
  sink_.answer = WriteEnd::ok;
  StartServer();
  const RawClient client = Connect();
  const RawClient other(server_->port(1));
  EXPECT_EQ(Ask(client, 1, "06 00 00 00 01"), "06 00 00 00 01");
  EXPECT_EQ(Ask(other, 1, kOwn), "03 02 FF FE");
  const std::uint16_t port = server_->port();
  next_.modbus.listen[0].permit = config::Permit::read;
  Renewal renewal = Same(2, 0);
  renewal.listeners[0].same = false;
  Renew(renewal);
  EXPECT_TRUE(client.IsClosed());
  EXPECT_EQ(server_->port(), port);
  EXPECT_EQ(AskOnce(1, "06 00 00 00 01"), "86 01");
  EXPECT_EQ(AskOnce(1, kOwn), "03 02 FF FE");
  EXPECT_EQ(Ask(other, 1, kOwn), "03 02 FF FE");
  EXPECT_EQ(server_->counters().clients, 1U + 2U - 2U) << "those that asked once are closed";
}

TEST_F(RenewalTest, ARemovedListenerClosesWithItsClients) {
  StartServer();
  const RawClient client = Connect();
  const RawClient other(server_->port(1));
  const std::uint16_t gone = server_->port(1);
  EXPECT_EQ(Ask(other, 1, kOwn), "03 02 FF FE");
  next_.modbus.listen.pop_back();
  Renew(Same(1, 0));
  EXPECT_TRUE(other.IsClosed());
  EXPECT_FALSE(RawClient(gone).connected());
  EXPECT_EQ(Ask(client, 1, kOwn), "03 02 FF FE");
  EXPECT_THAT(server_->Traffic().clients, SizeIs(1));
}

TEST_F(RenewalTest, ListenersMayChangePlaces) {
  StartServer();
  const std::uint16_t first = server_->port(0);
  const std::uint16_t second = server_->port(1);
  Renewal renewal = Same(2, 0);
  std::swap(renewal.listeners[0], renewal.listeners[1]);
  Renew(renewal);
  EXPECT_EQ(server_->port(0), second);
  EXPECT_EQ(server_->port(1), first);
}

TEST_F(RenewalTest, AClientOfANewPortWaitsUntilTheReloadIsApplied) {
  StartServer();
  next_.modbus.listen.push_back(listener());
  Renewal renewal = Same(2, 0);
  renewal.listeners.push_back(Opened(listener()));
  const RawClient early(renewal.listeners[2].opened.tcp->port());
  ASSERT_TRUE(early.connected());
  early.Send(Frame(1, kOwn));
  Renew(renewal);
  EXPECT_EQ(ToHex(early.ReceiveFrame()), "12 34 00 00 00 05 01 03 02 FF FE");
}

TEST_F(RenewalTest, APortInUseIsNamedAndNothingChanges) {
  StartServer();
  const RawClient client = Connect();
  config::Listener taken = listener();
  taken.port = server_->port(1);
  const auto port = server_->OpenPort(taken);
  ASSERT_FALSE(port.ok());
  EXPECT_THAT(port.error(), HasSubstr("address already in use; stop the program that uses it"));
  EXPECT_EQ(Ask(client, 1, kOwn), "03 02 FF FE");
}

TEST_F(RenewalTest, AnUnusedNewPortIsClosed) {
  StartServer();
  config::Listener more = listener();
  {
    const ListenerOrigin opened = Opened(more);
    more.port = opened.opened.tcp->port();
    EXPECT_FALSE(server_->OpenPort(more).ok());
  }
  EXPECT_TRUE(server_->OpenPort(more).ok());
}

/// A renewal opens a port that is still in use when the previous listener has closed.
TEST_F(RenewalTest, AnOccupiedPortIsOpenedWhenThePreviousListenerCloses) {
  StartServer();
  next_.modbus.listen[1].host = "0.0.0.0";
  next_.modbus.listen[1].port = server_->port(1);
  ASSERT_FALSE(server_->OpenPort(next_.modbus.listen[1]).ok());
  Renewal renewal = Same(1, 0);
  renewal.listeners.emplace_back();
  Renew(renewal);
  EXPECT_EQ(server_->port(1), next_.modbus.listen[1].port);
  EXPECT_THAT(server_->Missing(), IsEmpty());
  EXPECT_EQ(Ask(RawClient(server_->port(1)), 1, kOwn), "03 02 FF FE");
}

TEST_F(RenewalTest, AMissingPortIsNamedAndMayBeRemovedAgain) {
  StartServer();
  next_.modbus.listen.push_back(next_.modbus.listen[0]);
  next_.modbus.listen[2].port = server_->port(0);
  const std::string why = "127.0.0.1:" + std::to_string(server_->port(0)) + ": address already";
  Renewal renewal = Same(2, 0);
  renewal.listeners.emplace_back();
  Renew(renewal);
  ASSERT_THAT(server_->Missing(), ElementsAre(HasSubstr("listener " + why)));
  ASSERT_THAT(server_->Traffic().closed, SizeIs(1));
  EXPECT_THAT(server_->Traffic().closed[0].why, HasSubstr("address already in use"));
  renewal = Same(3, 0);
  renewal.listeners[2].same = false;
  Renew(renewal);
  EXPECT_THAT(server_->Missing(), SizeIs(1));
  next_.modbus.listen.pop_back();
  Renew(Same(2, 0));
  EXPECT_THAT(server_->Missing(), IsEmpty());
  EXPECT_THAT(server_->Traffic().closed, IsEmpty());
  EXPECT_EQ(AskOnce(1, kOwn), "03 02 FF FE");
}

TEST_F(RenewalTest, APendingRequestEndsAtItsRemovedRoute) {
  Add(1, 20, 20);
  Add(2, 30, 30);
  next_ = config_;
  StartServer();
  const RawClient client = Connect();
  client.Send(Frame(20, kRead, 1));
  const bus::RoutedRequest under_way = drive_.Wait(0);
  next_.modbus.routes.erase(next_.modbus.routes.begin());
  Renewal renewal = Same(2, 0);
  renewal.routes = {1};
  Renew(renewal);
  EXPECT_EQ(Ask(client, 20, kRead), "83 0A");
  under_way.done(GoodReply("03 02 00 07"));
  EXPECT_EQ(ToHex(client.ReceiveFrame()), "00 01 00 00 00 05 14 03 02 00 07");
  ASSERT_THAT(server_->Traffic().routes, SizeIs(1));
  EXPECT_EQ(server_->Traffic().routes[0].units, "30");
  EXPECT_EQ(server_->Traffic().routes[0].requests, 0U);
  EXPECT_EQ(server_->Traffic().routes[0].ok, 0U);
}

TEST_F(RenewalTest, UnchangedRoutesKeepTheirCountersInAnyOrder) {
  Add(1, 20, 21);
  Add(2, 20, 30);
  next_ = config_;
  drive_.answer = pumps_.answer = Count;
  StartServer();
  const RawClient client = Connect();
  EXPECT_EQ(Ask(client, 20, kRead), "03 02 01 F4");
  EXPECT_EQ(Ask(client, 30, kRead), "03 02 01 F4");
  EXPECT_EQ(Ask(client, 30, kRead), "03 02 01 F4");
  std::swap(next_.modbus.routes[0], next_.modbus.routes[1]);
  next_.modbus.routes.insert(next_.modbus.routes.begin(), RouteTo(next_, 1, 40, 40));
  Renewal renewal = Same(2, 0);
  renewal.routes = {std::nullopt, 1, 0};
  Renew(renewal);
  EXPECT_EQ(Ask(client, 20, kRead), "03 02 01 F4");
  const auto routes = server_->Traffic().routes;
  ASSERT_THAT(routes, SizeIs(3));
  EXPECT_EQ(routes[0].units, "40");
  EXPECT_EQ(routes[0].requests, 0U);
  EXPECT_EQ(routes[1].units, "20-30");
  EXPECT_EQ(routes[1].ok, 3U) << "the first that names the unit wins";
  EXPECT_EQ(routes[2].units, "20-21");
  EXPECT_EQ(routes[2].ok, 1U);
}

TEST_F(RenewalTest, AllListenersMayBeRemovedAndAddedAgain) {
  StartServer();
  next_.modbus.listen.clear();
  Renew({});
  EXPECT_EQ(server_->port(), 0);
  EXPECT_THAT(server_->Traffic().clients, IsEmpty());
  next_.modbus.listen.push_back(listener());
  Renewal renewal;
  renewal.listeners.push_back(Opened(listener()));
  Renew(renewal);
  EXPECT_EQ(AskOnce(1, kOwn), "03 02 FF FE");
}

using asio::ip::tcp;

constexpr int kFirst = 3;

tcp::endpoint Loopback(std::uint16_t port) { return {asio::ip::address_v4::loopback(), port}; }

/// Runs in a separate process, because it overwrites the descriptors 3 and 4.
int TakesItsOwn() {
  asio::io_context io;
  tcp::acceptor wanted(io, Loopback(0));
  tcp::acceptor other(io, Loopback(0));
  const std::uint16_t port = wanted.local_endpoint().port();
  const int sockets[] = {::fcntl(wanted.native_handle(), F_DUPFD, 100),
                         ::fcntl(other.native_handle(), F_DUPFD, 100)};
  for (int i = 0; i < 2; ++i) ::dup2(sockets[i], kFirst + i);
  ::setenv("LISTEN_PID", std::to_string(::getpid()).c_str(), 1);
  ::setenv("LISTEN_FDS", "2", 1);
  PassedSockets passed;
  if (std::getenv("LISTEN_FDS") != nullptr || std::getenv("LISTEN_PID") != nullptr) return 1;
  if (passed.Take({asio::ip::address_v4::any(), port})) return 2;
  if (passed.Take({asio::ip::address_v6::loopback(), port})) return 3;
  const auto taken = passed.Take(Loopback(port));
  if (taken != kFirst) return 4;
  if ((::fcntl(kFirst, F_GETFD) & FD_CLOEXEC) == 0) return 5;
  return passed.Take(Loopback(port)) ? 6 : 0;
}

TEST(PassedSocketsDeathTest, AreMatchedToListenersByAddress) {
  EXPECT_EXIT(std::_Exit(TakesItsOwn()), ::testing::ExitedWithCode(0), "");
}

TEST(PassedSockets, AreIgnoredByAnotherProcess) {
  ::setenv("LISTEN_PID", "1", 1);
  ::setenv("LISTEN_FDS", "1", 1);
  {
    PassedSockets passed;
    EXPECT_FALSE(passed.Take(Loopback(502)));
  }
  ::unsetenv("LISTEN_PID");
  ::unsetenv("LISTEN_FDS");
}

PeerAddress Peer(const std::string& text) {
  const auto address = asio::ip::make_address(text);
  if (address.is_v6()) return address.to_v6().to_bytes();
  return asio::ip::make_address_v6(asio::ip::v4_mapped, address.to_v4()).to_bytes();
}

config::Network Network(const std::string& address, int prefix) {
  config::Network network;
  network.text = address + "/" + std::to_string(prefix);
  network.bytes = Peer(address);
  network.prefix = address.find(':') == std::string::npos ? 96 + prefix : prefix;
  return network;
}

TEST(Access, AnEmptyListAllowsEverybody) { EXPECT_TRUE(Allows({}, Peer("203.0.113.9"))); }

TEST(Access, Ipv4NetworksEndAtTheirPrefix) {
  const std::vector list = {Network("10.0.0.0", 8), Network("192.0.2.128", 25)};
  EXPECT_TRUE(Allows(list, Peer("10.255.0.1")));
  EXPECT_FALSE(Allows(list, Peer("11.0.0.1")));
  EXPECT_TRUE(Allows(list, Peer("192.0.2.200")));
  EXPECT_FALSE(Allows(list, Peer("192.0.2.127")));
}

TEST(Access, AMappedPeerIsTreatedAsItsIpv4Address) {
  const std::vector list = {Network("127.0.0.1", 32)};
  EXPECT_TRUE(Allows(list, Peer("::ffff:127.0.0.1")));
  EXPECT_FALSE(Allows(list, Peer("::ffff:127.0.0.2")));
  EXPECT_FALSE(Allows(list, Peer("::7f00:1")));
}

TEST(Access, Ipv4BytesNeedNoMappedPrefix) {
  config::Network network = Network("127.0.0.1", 32);
  network.bytes[10] = network.bytes[11] = 0;
  EXPECT_TRUE(Allows(std::vector{network}, Peer("127.0.0.1")));
}

TEST(Access, Ipv6NetworksEndAtTheirPrefix) {
  const std::vector list = {Network("2001:db8::", 32), Network("::1", 128)};
  EXPECT_TRUE(Allows(list, Peer("2001:db8:1::5")));
  EXPECT_FALSE(Allows(list, Peer("2001:db9::5")));
  EXPECT_TRUE(Allows(list, Peer("::1")));
  EXPECT_FALSE(Allows(list, Peer("127.0.0.1")));
}

TEST(Access, TheIpv4NetworkOfAllDoesNotIncludeIpv6) {
  const std::vector list = {Network("0.0.0.0", 0)};
  EXPECT_TRUE(Allows(list, Peer("203.0.113.9")));
  EXPECT_FALSE(Allows(list, Peer("2001:db8::1")));
}

TEST(Access, TheFirstMatchingClientRuleGivesThePriority) {
  using config::Priority;
  config::Listener listener;
  listener.priority = Priority::low;
  listener.clients = {{Network("10.0.0.7", 32), Priority::high},
                      {Network("10.0.0.0", 8), Priority::normal},
                      {Network("10.0.0.7", 32), Priority::low}};
  EXPECT_EQ(PriorityOf(listener, Peer("10.0.0.7")), Priority::high);
  EXPECT_EQ(PriorityOf(listener, Peer("10.0.0.8")), Priority::normal);
  EXPECT_EQ(PriorityOf(listener, Peer("192.0.2.1")), Priority::low);
}

}  // namespace
}  // namespace baudgate::modbus
