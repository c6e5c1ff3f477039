// Tests what Fast DDS sends to a discovery server, which the test simulates.
// SPDX-License-Identifier: Apache-2.0
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "gateway/outputs/dds/fast/fast_writer.h"
#include "gateway/outputs/dds/fast/subscriber.h"
#include "gateway/outputs/dds/rtps/announcement.h"
#include "tests/gateway/outputs/dds/fixture.h"

namespace baudgate::dds {
namespace {

using testing::TestDomain;

class FakeDiscoveryServer : public ::testing::Test {
 protected:
  void SetUp() override {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t length = sizeof at;
    ASSERT_EQ(::bind(socket_, reinterpret_cast<const sockaddr*>(&at), length), 0);
    ASSERT_EQ(::getsockname(socket_, reinterpret_cast<sockaddr*>(&at), &length), 0);
    options_.domain = TestDomain();
    options_.interfaces = {"127.0.0.1"};
    options_.multicast = false;
    options_.discovery_servers = {{"127.0.0.1", ntohs(at.sin_port)}};
  }
  ~FakeDiscoveryServer() override { ::close(socket_); }

  Result<Announcement> Receive() const {
    std::array<std::uint8_t, 0x10000> buffer;
    sockaddr_in from{};
    socklen_t length = sizeof from;
    const ssize_t size = ::recvfrom(socket_, buffer.data(), buffer.size(), 0,
                                    reinterpret_cast<sockaddr*>(&from), &length);
    if (size < 0) return Error{"nothing came"};
    return ReadAnnouncement(View(buffer.data(), static_cast<std::size_t>(size)),
                            {ntohl(from.sin_addr.s_addr), ntohs(from.sin_port)});
  }

  int socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  ParticipantOptions options_;
};

TEST_F(FakeDiscoveryServer, ReceivesTheAnnouncementOfAGateway) {
  const auto writer = CreateFastWriter(options_, {.points = 1, .devices = 1});
  ASSERT_TRUE(writer) << writer.error();
  const auto heard = Receive();
  ASSERT_TRUE(heard) << heard.error();
  EXPECT_EQ(heard->role, Role::publishes);
  EXPECT_EQ(heard->domain, static_cast<std::uint32_t>(TestDomain()));
  EXPECT_EQ(heard->at.address, INADDR_LOOPBACK);
  EXPECT_EQ(heard->lease, 11s) << "10 s, and what is below a second";
}

TEST_F(FakeDiscoveryServer, ReceivesTheAnnouncementOfASubscriber) {
  SubscriberOptions options;
  options.participant = options_;
  const auto subscriber = DdsSubscriber::Create(options, {});
  ASSERT_TRUE(subscriber) << subscriber.error();
  const auto heard = Receive();
  ASSERT_TRUE(heard) << heard.error();
  EXPECT_EQ(heard->role, Role::subscribes);
}

}  // namespace
}  // namespace baudgate::dds
