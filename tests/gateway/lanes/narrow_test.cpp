// Servers that are not up to several requests at a time: each is found out, said so, and polled as
// every other line from then on. No value ever goes to another device.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "tests/gateway/lanes/lanes_rig.h"

namespace baudgate {
namespace {

using testing::HasSubstr;
using testing::SizeIs;
using testing::StartsWith;
using Kind = ServerManner::Kind;

class NarrowTest : public testing::TestWithParam<std::pair<ServerManner, std::string>> {};

TEST_P(NarrowTest, ItIsFoundOutAndPolledOneByOne) {
  // 18 requests one after the other have to fit into it.
  const Duration poll = 20 * GetParam().first.think;
  LanesRig rig(6, 4, [poll](config::Line& line) {
    for (config::Device& device : line.devices) device.poll = poll;
  });
  rig.manner = GetParam().first;
  rig.Start();
  EXPECT_TRUE(rig.RunUntil(
      [&] { return rig.status().port_text.starts_with("fake, one request at a time: "); }, 2min));
  EXPECT_THAT(rig.status().port_text, HasSubstr(GetParam().second));
  if (rig.manner.kind != Kind::repeats) {
    EXPECT_TRUE(rig.RunUntil([&] { return rig.AllGood(); }, 1min));
  }
  const std::size_t opens = rig.opens;
  const std::uint64_t counted = rig.status().exchanges;
  rig.RunFor(3min);
  EXPECT_EQ(rig.wrong, 0U);
  EXPECT_GT(rig.status().exchanges, counted);
  if (rig.manner.kind == Kind::repeats) return;
  EXPECT_TRUE(rig.AllGood());
  EXPECT_EQ(rig.opens, opens);
  EXPECT_NEAR(static_cast<double>(rig.status().exchanges), static_cast<double>(rig.asked), 24);
}

INSTANTIATE_TEST_SUITE_P(
    Servers, NarrowTest,
    testing::Values(std::pair(ServerManner{Kind::first_only, 30ms}, "when nothing else is asked"),
                    std::pair(ServerManner{Kind::refuses, 30ms}, "when nothing else is asked"),
                    std::pair(ServerManner{Kind::closes, 30ms}, "closes the connection"),
                    std::pair(ServerManner{Kind::one_by_one, 600ms}, "too late"),
                    std::pair(ServerManner{Kind::swaps, 30ms}, "answers a request to"),
                    std::pair(ServerManner{Kind::repeats, 30ms}, "answers a request to")),
    [](const auto& info) { return "S" + std::to_string(info.index); });

TEST(Narrow, WhatIsOutOfUseStaysSo) {
  LanesRig rig(4, 4);
  rig.Start();
  rig.RunFor(10s);
  rig.driver().SetInUse(2, false, rig.now());
  rig.manner.kind = Kind::swaps;
  EXPECT_TRUE(
      rig.RunUntil([&] { return rig.status().port_text.starts_with("fake, one request"); }, 1min));
  rig.RunFor(10s);
  EXPECT_EQ(rig.StatusOf(2).state, DeviceState::disabled);
  EXPECT_TRUE(rig.Good(0));
  EXPECT_FALSE(rig.Good(2));
}

TEST(Narrow, WritesUnderWayAreAnsweredOnceAndNeverRepeated) {
  LanesRig rig(4, 4);
  rig.Start();
  EXPECT_TRUE(rig.RunUntil([&] { return rig.AllGood(); }, 5s));
  rig.manner.kind = Kind::swaps;
  for (std::uint32_t device = 0; device < 4; ++device) rig.Write(device, rig.Truth(device, 0) + 1);
  rig.RunFor(1min);
  EXPECT_THAT(rig.ends, SizeIs(4));
  for (std::uint32_t device = 0; device < 4; ++device) EXPECT_LE(rig.wire[device], 1);
  EXPECT_EQ(rig.wrong, 0U);
}

/// A cable that is pulled now and then under load.
TEST(Narrow, RareLossesAreNothing) {
  LanesRig rig(4, 4, [](config::Line& line) {
    for (config::Device& device : line.devices) device.poll = 5s;
  });
  rig.Start();
  for (int i = 0; i < 10; ++i) {
    rig.RunFor(7min);
    rig.CloseByServer();
  }
  rig.RunFor(1min);
  EXPECT_TRUE(rig.AllGood());
  EXPECT_THAT(rig.status().port_text, StartsWith("fake, up to 4"));
}

/// Everything at random: whatever the server does, a value is its device's.
TEST(Narrow, NoValueEverGoesToAnotherDevice) {
  std::mt19937 engine(3);
  const auto random = [&engine](unsigned below) { return static_cast<unsigned>(engine() % below); };
  for (int run = 0; run < 6; ++run) {
    LanesRig rig(6, 2 + run % 5, [](config::Line& line) {
      for (config::Device& device : line.devices) device.poll = 500ms;
    });
    rig.Start();
    for (int i = 0; i < 60; ++i) {
      rig.manner = {static_cast<Kind>(random(8)),
                    Duration(1ms) * (1 + random(random(3) == 0 ? 1500 : 60))};
      rig.dead.clear();
      if (random(3) == 0) rig.dead.insert(random(6));
      rig.there = random(8) != 0;
      if (random(10) == 0 && rig.status().port == LineStatus::Port::open) rig.CloseByServer();
      if (random(4) == 0) {
        const std::uint32_t device = random(6);
        rig.Write(device, rig.Truth(device, 0) + random(100), 2s);
      }
      rig.RunFor(Duration(1ms) * random(20'000));
    }
    EXPECT_EQ(rig.wrong, 0U) << "run " << run;
    rig.manner = {};
    rig.dead.clear();
    rig.there = true;
    EXPECT_TRUE(rig.RunUntil([&] { return rig.AllGood(); }, 5min)) << "run " << run;
  }
}

}  // namespace
}  // namespace baudgate
