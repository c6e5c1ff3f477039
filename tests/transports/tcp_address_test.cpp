// tcp://host:port as users write it, right and wrong.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "transports/tcp_client.h"

namespace baudgate {
namespace {

void ExpectAddress(const char* text, const char* host, int port) {
  const auto address = ParseTcpPort(text);
  ASSERT_TRUE(address.ok()) << address.error();
  EXPECT_EQ(address->host, host);
  EXPECT_EQ(address->port, port);
}

TEST(TcpAddress, NamesAndAddresses) {
  ExpectAddress("tcp://moxa-7.local:4001", "moxa-7.local", 4001);
  ExpectAddress("tcp://192.0.2.7:1", "192.0.2.7", 1);
  ExpectAddress("tcp://[::1]:4001", "::1", 4001);
  ExpectAddress("tcp://[fe80::1%eth0]:65535", "fe80::1%eth0", 65535);
}

TEST(TcpAddress, WrongOnesAreErrorsThatNameThem) {
  for (const char* text : {"",
                           "/dev/ttyUSB0",
                           "tcp:/host:1",
                           "tcp://",
                           "tcp://host",
                           "tcp://host:",
                           "tcp://:4001",
                           "tcp://host:0",
                           "tcp://host:65536",
                           "tcp://host:-1",
                           "tcp://host:+1",
                           "tcp://host:4001/",
                           "tcp://host: 4001",
                           "tcp://::1:4001",
                           "tcp://[::1]",
                           "tcp://[::1]4001",
                           "tcp://[::1:4001",
                           "tcp://[]:4001",
                           "tcp://[host]:4001",
                           "tcp://user@host:4001",
                           "tcp://a b:4001"}) {
    const auto address = ParseTcpPort(text);
    ASSERT_FALSE(address.ok()) << text;
    EXPECT_NE(address.error().find(text), std::string::npos);
  }
}

TEST(TcpAddress, OnlyTheSchemeDecides) {
  EXPECT_TRUE(IsTcpPort("tcp://wrong"));
  EXPECT_FALSE(IsTcpPort("/dev/serial/by-id/tcp://"));
}

}  // namespace
}  // namespace baudgate
