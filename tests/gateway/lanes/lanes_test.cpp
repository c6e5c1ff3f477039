// A line with several lanes: servers that are up to several requests at a time.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/lanes/lanes.h"

#include <gmock/gmock.h>

#include "tests/gateway/lanes/lanes_rig.h"

namespace baudgate {
namespace {

using testing::AllOf;
using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pair;
using testing::SizeIs;
using Kind = ServerManner::Kind;

std::vector<config::Device> Devices(const std::vector<std::string>& addresses) {
  std::vector<config::Device> devices(addresses.size());
  for (std::size_t i = 0; i < addresses.size(); ++i) devices[i].address = addresses[i];
  return devices;
}

TEST(PartDevices, GivesPartsOfAboutOneSize) {
  EXPECT_THAT(PartDevices(Devices({"1", "2", "3", "4", "5"}), 2),
              ElementsAre(Pair(0, 3), Pair(3, 5)));
  EXPECT_THAT(PartDevices(Devices({"1", "2"}), 4), ElementsAre(Pair(0, 1), Pair(1, 2)));
  EXPECT_THAT(PartDevices(Devices({"1", "2"}), 1), ElementsAre(Pair(0, 2)));
  EXPECT_THAT(PartDevices({}, 4), SizeIs(0));
}

TEST(PartDevices, NeverPartsOneAddress) {
  EXPECT_THAT(PartDevices(Devices({"1", "2", "1", "4"}), 4), ElementsAre(Pair(0, 3), Pair(3, 4)));
  EXPECT_THAT(PartDevices(Devices({"7", "7", "7"}), 3), ElementsAre(Pair(0, 3)));
}

TEST(Lanes, SeveralRequestsAreUnderWayAtATimeAndNoMore) {
  LanesRig rig(8, 4);
  rig.Start();
  EXPECT_TRUE(rig.RunUntil([&] { return rig.AllGood(); }, 2s));
  rig.RunFor(1min);
  EXPECT_TRUE(rig.AllGood());
  EXPECT_EQ(rig.most_under_way(), 4U);
  EXPECT_EQ(rig.wrong, 0U);
  EXPECT_EQ(rig.opens, 1U);
  EXPECT_EQ(rig.status().port_text, "fake, up to 4 requests at a time");
}

TEST(Lanes, OneIsAskedAsBefore) {
  LanesRig rig(4, 1);
  rig.Start();
  rig.RunFor(10s);
  EXPECT_EQ(rig.most_under_way(), 1U);
  EXPECT_EQ(rig.status().port_text, "fake");
}

/// 8 devices with 3 requests each of 20 ms take 480 ms one after the other.
TEST(Lanes, ARoundTakesAsMuchLessTime) {
  std::size_t asked[2];
  for (const int pipeline : {1, 4}) {
    LanesRig rig(8, pipeline);
    rig.Start();
    rig.RunFor(1min);
    asked[pipeline / 4] = rig.asked;
    EXPECT_EQ(rig.wrong, 0U);
  }
  EXPECT_GT(asked[1], 3 * asked[0]);
}

TEST(Lanes, RepliesInAnyOrderAreTheirDevices) {
  LanesRig rig(8, 8);
  rig.manner = {Kind::shuffled, 80ms};
  rig.Start();
  rig.RunFor(1min);
  EXPECT_TRUE(rig.AllGood());
  EXPECT_GT(rig.most_under_way(), 4U);
  EXPECT_EQ(rig.wrong, 0U);
  for (std::uint32_t device = 0; device < 8; ++device) {
    EXPECT_EQ(rig.StatusOf(device).retries, 0U);
  }
}

TEST(Lanes, AServerThatTakesOneAfterTheOtherFastEnoughIsWell) {
  LanesRig rig(8, 4);
  rig.manner = {Kind::one_by_one, 50ms};
  rig.Start();
  rig.RunFor(1min);
  EXPECT_TRUE(rig.AllGood());
  EXPECT_EQ(rig.opens, 1U);
  EXPECT_EQ(rig.wrong, 0U);
}

TEST(Lanes, NobodyStarves) {
  LanesRig rig(7, 3);
  rig.manner = {Kind::shuffled, 40ms};
  rig.Start();
  rig.RunFor(1min);
  std::uint32_t least = ~0U;
  std::uint32_t most = 0;
  for (std::uint32_t device = 0; device < 7; ++device) {
    least = std::min(least, rig.StatusOf(device).exchanges);
    most = std::max(most, rig.StatusOf(device).exchanges);
  }
  EXPECT_GT(least * 2, most);
}

TEST(Lanes, ADeadDeviceCostsTheOthersNothing) {
  LanesRig rig(4, 4);
  rig.dead = {2};
  rig.Start();
  rig.RunFor(3min);
  EXPECT_EQ(rig.StatusOf(2).state, DeviceState::offline);
  for (const std::uint32_t device : {0U, 1U, 3U}) {
    EXPECT_TRUE(rig.Good(device));
    EXPECT_EQ(rig.StatusOf(device).retries, 0U);
  }
  EXPECT_EQ(rig.opens, 1U) << "it says nothing of the server";
  rig.dead = {};
  EXPECT_TRUE(rig.RunUntil([&] { return rig.AllGood(); }, 2min));
  EXPECT_EQ(rig.opens, 1U);
}

TEST(Lanes, AServerThatDiesTakesAllValuesAndGivesThemBack) {
  LanesRig rig(6, 3);
  rig.Start();
  rig.RunFor(1min);
  rig.there = false;
  rig.CloseByServer();
  EXPECT_EQ(rig.status().port, LineStatus::Port::closed);
  for (std::uint32_t device = 0; device < 6; ++device) EXPECT_FALSE(rig.Good(device));
  const std::size_t asked = rig.asked;
  rig.RunFor(1min);
  EXPECT_EQ(rig.asked, asked);
  rig.there = true;
  EXPECT_TRUE(rig.RunUntil([&] { return rig.AllGood(); }, 10s));
  EXPECT_EQ(rig.status().port_text, "fake, up to 3 requests at a time") << "once is nothing";
  EXPECT_EQ(rig.wrong, 0U);
}

/// Its TCP lives.
TEST(Lanes, AServerThatHangsIsConnectedAnew) {
  LanesRig rig(6, 3);
  rig.Start();
  rig.RunFor(1min);
  rig.there = false;
  rig.RunFor(20s);
  EXPECT_EQ(rig.status().times_lost, 0U);
  rig.RunFor(40s);
  EXPECT_GE(rig.status().times_lost, 1U);
  rig.there = true;
  EXPECT_TRUE(rig.RunUntil([&] { return rig.AllGood(); }, 1min));
  EXPECT_EQ(rig.wrong, 0U);
}

TEST(Lanes, TheStatusOfTheLineIsThatOfAllLanes) {
  LanesRig rig(8, 4);
  rig.Start();
  rig.RunFor(2min);
  const LineStatus status = rig.status();
  std::uint64_t exchanges = 0;
  for (std::uint32_t device = 0; device < 8; ++device) exchanges += rig.StatusOf(device).exchanges;
  EXPECT_EQ(status.exchanges, exchanges);
  EXPECT_EQ(status.Count(Outcome::ok), exchanges);
  EXPECT_EQ(status.round_trips.count(), exchanges);
  EXPECT_NEAR(static_cast<double>(rig.asked), static_cast<double>(exchanges), 4);
  EXPECT_GT(status.bytes_in, 0U);
  EXPECT_GT(status.use, 0.1);
  EXPECT_LE(status.use, 1.0);
}

TEST(Lanes, WritesGoToTheirDevices) {
  LanesRig rig(8, 4);
  rig.manner = {Kind::shuffled, 60ms};
  rig.Start();
  EXPECT_TRUE(rig.RunUntil([&] { return rig.AllGood(); }, 5s));
  for (std::uint32_t device = 0; device < 8; ++device) rig.Write(device, rig.Truth(device, 0) + 5);
  rig.RunFor(10s);
  EXPECT_THAT(rig.ends, AllOf(SizeIs(8), Each(WriteEnd::ok)));
  for (std::uint32_t device = 0; device < 8; ++device) EXPECT_EQ(rig.wire[device], 1);
  EXPECT_EQ(rig.wrong, 0U);
}

TEST(Lanes, WritesOnALostConnectionAreAnsweredOnce) {
  LanesRig rig(4, 4);
  rig.Start();
  EXPECT_TRUE(rig.RunUntil([&] { return rig.AllGood(); }, 5s));
  for (std::uint32_t device = 0; device < 4; ++device) rig.Write(device, rig.Truth(device, 0));
  rig.CloseByServer();
  EXPECT_THAT(rig.ends, SizeIs(4));
  rig.RunFor(10s);
  EXPECT_THAT(rig.ends, SizeIs(4));
}

TEST(Lanes, ALineIsLentAndTakenBackAsOne) {
  LanesRig rig(4, 2);
  rig.Start();
  rig.RunFor(10s);
  rig.driver().Release(5s, rig.now());
  rig.RunFor(1s);
  EXPECT_EQ(rig.status().port, LineStatus::Port::released);
  const std::size_t asked = rig.asked;
  rig.RunFor(3s);
  EXPECT_EQ(rig.asked, asked);
  EXPECT_TRUE(rig.RunUntil([&] { return rig.AllGood(); }, 5s));
  bool stopped = false;
  rig.driver().Stop(rig.now(), [&] { stopped = true; });
  rig.RunFor(2s);
  EXPECT_TRUE(stopped);
}

TEST(Lanes, ADeviceIsTakenOutOfUse) {
  LanesRig rig(4, 4);
  rig.Start();
  rig.RunFor(10s);
  rig.driver().SetInUse(2, false, rig.now());
  rig.RunFor(10s);
  EXPECT_EQ(rig.StatusOf(2).state, DeviceState::disabled);
  EXPECT_TRUE(rig.Good(3));
  rig.driver().SetInUse(2, true, rig.now());
  EXPECT_TRUE(rig.RunUntil([&] { return rig.AllGood(); }, 5s));
}

}  // namespace
}  // namespace baudgate
