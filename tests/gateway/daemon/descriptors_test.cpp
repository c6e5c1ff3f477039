// Tests how many file descriptors the daemon requests, and how it divides them.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/descriptors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

namespace baudgate::daemon {
namespace {

using testing::HasSubstr;

outputs::DescriptorNeeds Needs(const config::Config& config) {
  return DescriptorNeedsOf(config, AllOutputs());
}

TEST(DescriptorsTest, EveryClientPortAndServerNeedsDescriptors) {
  config::Config config;
  config.dds.enabled = false;
  const std::size_t base = Needs(config).others;
  EXPECT_EQ(Needs(config).clients, 0U);
  EXPECT_GE(base, 32U);
  config.lines.resize(100);
  const std::size_t with_lines = Needs(config).others;
  EXPECT_GE(with_lines, base + 400) << "port and loop of each";
  config.modbus.listen.resize(3);
  config.modbus.listen[1].max_clients = 10;
  config.modbus.listen[2].path = "/dev/ttyS1";
  config.modbus.routes.resize(50);
  EXPECT_EQ(Needs(config).clients, 266U) << "a serial port has no clients";
  EXPECT_GE(Needs(config).others, with_lines + 50 + 3);
  config.modbus.enabled = false;
  EXPECT_EQ(Needs(config).clients, 0U);
  config.dds.enabled = true;
  EXPECT_GE(Needs(config).others, with_lines + 32);
}

TEST(DescriptorsTest, ClientsShareTheDescriptorsThatPortsAndSocketsLeave) {
  const outputs::DescriptorNeeds needs{1280, 100, 0};
  EXPECT_EQ(ClientShare(needs, 1380), 1);
  EXPECT_EQ(ClientShare(needs, 100'000), 1);
  EXPECT_DOUBLE_EQ(ClientShare(needs, 420), 0.25);
  EXPECT_GT(ClientShare(needs, 100), 0);
  EXPECT_GT(ClientShare(needs, 0), 0);
  EXPECT_EQ(ClientShare({0, 100, 0}, 50), 1) << "nobody is turned away";
  const std::string text = ExplainClientShare(needs, 420);
  for (const char* part :
       {"320 clients", "not 1280", "420 files", "needs 100 of them", "to 1380"}) {
    EXPECT_THAT(text, HasSubstr(part));
  }
}

TEST(DescriptorsTest, ViewersOfThePageReceiveTheirOwnShare) {
  config::Config config;
  EXPECT_EQ(Needs(config).viewers, 0U);
  config.web.on = true;
  const std::size_t page = Needs(config).viewers;
  EXPECT_GT(page, 256U);
  const outputs::DescriptorNeeds needs{256, 100, page};
  EXPECT_EQ(ViewerShare(needs, needs.all()), page);
  EXPECT_EQ(ViewerShare(needs, 160), 20U);
  EXPECT_DOUBLE_EQ(ClientShare(needs, 160), 40.0 / 256);
  EXPECT_EQ(ViewerShare({256, 100, 0}, 160), 0U) << "there is no page";
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

TEST(OpenFiles, AreCountedWhenNoMoreCanBeOpened) {
  OpenFiles files;
  const std::size_t before = files.Now().open;
  const int more = ::dup(0);
  EXPECT_EQ(files.Now().open, before + 1);
  rlimit limit{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &limit), 0);
  const rlimit none{1, limit.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none), 0);
  const OpenFiles::Count count = files.Now();
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &limit), 0);
  ::close(more);
  EXPECT_EQ(count.open, before + 1);
  EXPECT_EQ(count.limit, 1U);
}

}  // namespace
}  // namespace baudgate::daemon
