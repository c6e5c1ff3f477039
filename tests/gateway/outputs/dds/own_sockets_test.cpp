// Tests of the messages about DDS sockets that the system refuses to open, and of real refusals of
// this system.
// SPDX-License-Identifier: Apache-2.0
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <memory>

#include "gateway/outputs/dds/fast/own_network.h"

namespace baudgate::dds {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

const SocketFacts kFine = {.has_port = true,
                           .unjoined = {},
                           .receive_bytes = kSocketBuffer,
                           .send_bytes = kSocketBuffer,
                           .given_ports = {32768, 60999}};

TEST(SocketRemarks, ExplainEachSocketProblem) {
  const ParticipantOptions options{.domain = 150, .interfaces = {"127.0.0.1"}};
  EXPECT_THAT(RemarksOn(kFine, options), IsEmpty());
  SocketFacts facts = kFine;
  facts.has_port = false;
  facts.unjoined = {"127.0.0.1"};
  EXPECT_THAT(
      RemarksOn(facts, options),
      ElementsAre(AllOf(HasSubstr("UDP port 44900"), HasSubstr("ip_local_reserved_ports=44900"))));
  EXPECT_THAT(RemarksOn(facts, {.domain = 3, .interfaces = {}}),
              ElementsAre(AllOf(HasSubstr("UDP port 8150"), Not(HasSubstr("reserve")))));
  facts.has_port = true;
  facts.unjoined = {"10.0.0.5", "10.1.0.5"};
  EXPECT_THAT(RemarksOn(facts, options), ElementsAre(HasSubstr("is discovered on 10.0.0.5"),
                                                     HasSubstr("is discovered on 10.1.0.5")));
  facts = kFine;
  facts.receive_bytes = 212992;
  facts.send_bytes = 106496;
  EXPECT_THAT(
      RemarksOn(facts, options),
      ElementsAre(
          AllOf(HasSubstr("208 KiB instead of 4096 KiB"), HasSubstr("net.core.rmem_max=")),
          AllOf(HasSubstr("104 KiB instead of 4096 KiB"), HasSubstr("net.core.wmem_max="))));
}

class UdpSocket {
 public:
  UdpSocket(const char* address, std::uint16_t port, bool shared)
      : descriptor_(::socket(AF_INET, SOCK_DGRAM, 0)) {
    const int on = 1;
    if (shared) ::setsockopt(descriptor_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_port = htons(port);
    ::inet_pton(AF_INET, address, &at.sin_addr);
    bound_ = ::bind(descriptor_, reinterpret_cast<const sockaddr*>(&at), sizeof at) == 0;
  }
  ~UdpSocket() { ::close(descriptor_); }
  UdpSocket(const UdpSocket&) = delete;
  UdpSocket& operator=(const UdpSocket&) = delete;

  bool bound() const { return bound_; }
  bool Join(const char* interface) const {
    ip_mreq group{};
    ::inet_pton(AF_INET, "239.255.0.1", &group.imr_multiaddr);
    ::inet_pton(AF_INET, interface, &group.imr_interface);
    return ::setsockopt(descriptor_, IPPROTO_IP, IP_ADD_MEMBERSHIP, &group, sizeof group) == 0;
  }

 private:
  const int descriptor_;
  bool bound_ = false;
};

class SocketFactsTest : public ::testing::Test {
 protected:
  SocketFactsTest() {
    options_.domain = 100 - static_cast<int>(::getpid() % 50);
    options_.interfaces = {"127.0.0.1"};
  }
  SocketFacts Facts() const { return FindSocketFacts(options_, FindOwnAddresses()); }
  std::uint16_t port() const { return MulticastPort(options_.domain); }

  ParticipantOptions options_;
};

TEST_F(SocketFactsTest, AMulticastGroupIsReceivedOnlyWhereItWasJoined) {
  EXPECT_FALSE(Facts().has_port);
  const UdpSocket elsewhere("127.0.0.1", port(), true);
  ASSERT_TRUE(elsewhere.bound());
  EXPECT_FALSE(Facts().has_port) << "bound to an address, it hears no group";
  const UdpSocket group("239.255.0.1", port(), true);
  ASSERT_TRUE(group.bound());
  EXPECT_TRUE(Facts().has_port);
  EXPECT_THAT(Facts().unjoined, ElementsAre("127.0.0.1"));
  ASSERT_TRUE(group.Join("127.0.0.1"));
  EXPECT_THAT(Facts().unjoined, IsEmpty());
  EXPECT_GT(Facts().receive_bytes, 0);
  options_.interfaces = {};
  EXPECT_THAT(Facts().unjoined, IsEmpty()) << "of all, one is enough";
  options_.multicast = false;
  EXPECT_TRUE(Facts().has_port) << "none is needed";
}

TEST_F(SocketFactsTest, APortThatIsFreeAgainIsDetected) {
  PortWatch watch;
  const auto look = [&] { return watch.Look(options_, FindOwnAddresses()); };
  EXPECT_EQ(look(), std::nullopt) << "nobody has taken it: to begin anew would not help";
  auto other = std::make_unique<UdpSocket>("127.0.0.1", port(), false);
  ASSERT_TRUE(other->bound());
  EXPECT_EQ(look(), std::nullopt) << "taken";
  other.reset();
  EXPECT_EQ(look(), "UDP port " + std::to_string(port()) + " is free now");
}

TEST(InterfaceWatch, ReportsChangesThatTheLibraryCannotFollow) {
  const OwnAddresses begin = {{"127.0.0.1", 1}, {"10.0.0.5", 2}, {"10.1.0.5", 3}, {"10.3.0.5", {}}};
  struct Row {
    std::vector<std::string> interfaces;
    OwnAddresses now;
    const char* why;
  };
  const Row rows[] = {
      {{"10.0.0.5"}, begin, ""},
      {{"10.0.0.5"}, {{"127.0.0.1", 1}}, ""},
      {{"127.0.0.1", "10.0.0.5"},
       {{"127.0.0.1", 1}},
       "this machine no longer has the address 10.0.0.5"},
      {{"127.0.0.1", "10.0.0.5"}, {{"127.0.0.1", 1}, {"10.0.0.5", {}}}, ""},
      {{"127.0.0.7", "10.0.0.5"},
       {{"127.0.0.1", 1}},
       "this machine no longer has the address 10.0.0.5"},
      {{"127.0.0.1", "10.2.0.5"}, begin, ""},
      {{"10.1.0.5", "10.0.0.5"}, {{"127.0.0.1", 1}}, ""},
      {{}, {{"127.0.0.1", 1}}, ""},
      {{"10.0.0.5"}, {{"10.0.0.5", 7}}, "the interface of 10.0.0.5 was created again"},
      // 10.1.0.5 is created again, but not used.
      {{"10.0.0.5"}, {{"10.0.0.5", 2}, {"10.1.0.5", 9}}, ""},
      {{"10.0.0.5"}, {{"10.0.0.5", 2}, {"10.2.0.5", 9}}, ""},
      {{"127.0.0.1", "10.1.0.5"}, {{"10.1.0.5", 9}}, "the interface of 10.1.0.5 was created again"},
      {{"10.0.0.5"}, {{"10.0.0.5", {}}}, ""},  // 10.0.0.5 is down
      {{"10.3.0.5"}, {{"10.3.0.5", 4}}, "the interface of 10.3.0.5 is up now"},
      {{"10.3.0.5"}, {{"10.3.0.5", {}}}, ""},
      {{}, {{"10.2.0.5", {}}}, ""},
      {{}, {{"10.2.0.5", 9}}, "this machine has a new address, 10.2.0.5"},
      {{"0.0.0.0"}, {{"10.0.0.5", 9}}, "the interface of 10.0.0.5 was created again"},
      {{}, {}, ""},
  };
  for (const Row& row : rows) {
    EXPECT_EQ(InterfaceWatch(row.interfaces, begin).Look(row.now).value_or(""), row.why);
  }
}

TEST(InterfaceWatch, FindsTheLoopback) {
  const OwnAddresses own = FindOwnAddresses();
  EXPECT_TRUE(own.at("127.0.0.1"));
  EXPECT_TRUE(IsOwn(own, "127.0.0.7"));
  EXPECT_FALSE(IsOwn(own, "192.0.2.1"));
  EXPECT_FALSE(IsOwn(own, "localhost"));
}

TEST(InterfaceWatch, ExplainsWhyAnInterfaceIsUnused) {
  const OwnAddresses own = {{"127.0.0.1", 1}, {"10.0.0.5", 2}, {"10.3.0.5", {}}};
  EXPECT_EQ(WhyUnused(own, "10.0.0.5"), std::nullopt);
  EXPECT_EQ(WhyUnused(own, "127.0.0.7"), std::nullopt);
  EXPECT_EQ(WhyUnused(own, "10.3.0.5"), "its interface is down or unplugged");
  EXPECT_EQ(WhyUnused(own, "10.4.0.5"), "no interface of this machine has this address now");
}

}  // namespace
}  // namespace baudgate::dds
