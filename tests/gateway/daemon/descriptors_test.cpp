// How many file descriptors are asked for, and what is made of those that are given.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/descriptors.h"

#include <gmock/gmock.h>
#include <sys/resource.h>

namespace baudgate::modbus {
namespace {

using testing::HasSubstr;

TEST(DescriptorsTest, EveryClientPortAndServerNeedsSome) {
  config::Config config;
  config.dds.enabled = false;
  const std::size_t base = DescriptorNeedsOf(config).others;
  EXPECT_EQ(DescriptorNeedsOf(config).clients, 0U);
  EXPECT_GE(base, 32U);
  config.lines.resize(100);
  const std::size_t with_lines = DescriptorNeedsOf(config).others;
  EXPECT_GE(with_lines, base + 400) << "port and loop of each";
  config.modbus.listen.resize(3);
  config.modbus.listen[1].max_clients = 10;
  config.modbus.listen[2].path = "/dev/ttyS1";
  config.modbus.routes.resize(50);
  EXPECT_EQ(DescriptorNeedsOf(config).clients, 266U) << "a serial port has no clients";
  EXPECT_GE(DescriptorNeedsOf(config).others, with_lines + 50 + 3);
  config.modbus.enabled = false;
  EXPECT_EQ(DescriptorNeedsOf(config).clients, 0U);
}

TEST(DescriptorsTest, ClientsGetWhatPortsAndSocketsLeave) {
  const DescriptorNeeds needs{1280, 100, 0};
  EXPECT_EQ(ClientShare(needs, 1380), 1);
  EXPECT_EQ(ClientShare(needs, 100'000), 1);
  EXPECT_DOUBLE_EQ(ClientShare(needs, 420), 0.25);
  EXPECT_GT(ClientShare(needs, 100), 0);
  EXPECT_GT(ClientShare(needs, 0), 0);
  EXPECT_EQ(ClientShare({0, 100, 0}, 50), 1) << "nobody is turned away";
  const std::string text = ExplainClientShare(needs, 420);
  for (const char* part : {"320 clients", "not 1280", "420 files", "100 are kept", "to 1380"}) {
    EXPECT_THAT(text, HasSubstr(part));
  }
}

TEST(DescriptorsTest, ViewersOfThePageTakeNoPlaceOfAClient) {
  const DescriptorNeeds needs{256, 100, kWebDescriptors};
  EXPECT_EQ(WebShare(needs, needs.all()), kWebDescriptors);
  EXPECT_EQ(WebShare(needs, 160), 20U);
  EXPECT_DOUBLE_EQ(ClientShare(needs, 160), 40.0 / 256);
  EXPECT_EQ(WebShare({256, 100, 0}, 160), 0U) << "there is no page";
}

TEST(DescriptorsTest, TheSoftLimitIsRaisedAsFarAsItMay) {
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &before), 0);
  rlimit low = before;
  low.rlim_cur = 200;
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &low), 0);
  EXPECT_EQ(RaiseDescriptorLimit(150), 200U) << "never lowered";
  EXPECT_EQ(RaiseDescriptorLimit(230), 230U);
  rlimit now{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &now), 0);
  EXPECT_EQ(now.rlim_cur, 230U);
  EXPECT_EQ(now.rlim_max, before.rlim_max);
  EXPECT_EQ(RaiseDescriptorLimit(before.rlim_max + 1), before.rlim_max);
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &before), 0);
}

}  // namespace
}  // namespace baudgate::modbus
