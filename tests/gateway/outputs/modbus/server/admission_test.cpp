// The allow list of a listener.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <asio/ip/address.hpp>
#include <string>
#include <vector>

#include "gateway/outputs/modbus/server/listener.h"

namespace baudgate::modbus {
namespace {

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

TEST(Access, Ipv4NetworksEndWhereTheirPrefixSays) {
  const std::vector list = {Network("10.0.0.0", 8), Network("192.0.2.128", 25)};
  EXPECT_TRUE(Allows(list, Peer("10.255.0.1")));
  EXPECT_FALSE(Allows(list, Peer("11.0.0.1")));
  EXPECT_TRUE(Allows(list, Peer("192.0.2.200")));
  EXPECT_FALSE(Allows(list, Peer("192.0.2.127")));
}

TEST(Access, AMappedPeerIsItsIpv4Address) {
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

TEST(Access, Ipv6Networks) {
  const std::vector list = {Network("2001:db8::", 32), Network("::1", 128)};
  EXPECT_TRUE(Allows(list, Peer("2001:db8:1::5")));
  EXPECT_FALSE(Allows(list, Peer("2001:db9::5")));
  EXPECT_TRUE(Allows(list, Peer("::1")));
  EXPECT_FALSE(Allows(list, Peer("127.0.0.1")));
}

TEST(Access, AllOfIpv4IsNotIpv6) {
  const std::vector list = {Network("0.0.0.0", 0)};
  EXPECT_TRUE(Allows(list, Peer("203.0.113.9")));
  EXPECT_FALSE(Allows(list, Peer("2001:db8::1")));
}

TEST(Access, TheFirstClientRuleThatFitsGivesThePriority) {
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
