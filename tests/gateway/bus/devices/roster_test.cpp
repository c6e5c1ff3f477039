// Who can be asked on a line.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/devices/roster.h"

#include <gtest/gtest.h>

#include "tests/gateway/bus/poller/part_fixture.h"

namespace baudgate {
namespace {

TEST(Roster, DevicesStandInTheOrderOfTheFile) {
  config::Line line = ToyLine({ToyDevice("a", "A", {"1"}), ToyDevice("b", "B", {"1"})});
  line.retries = 5;
  line.devices[1].retries = 1;
  line.devices[1].enabled = false;
  const Roster roster(line, 7, [](const std::string&) -> const Protocol& { return ToyProtocol(); });
  ASSERT_EQ(roster.devices().size(), 2U);
  EXPECT_EQ(roster.device(0).index, 7U);
  EXPECT_EQ(&roster.DeviceAt(8), &roster.device(1));
  EXPECT_EQ(roster.device(1).place, 1U);
  EXPECT_EQ(roster.device(0).max_retries, 5);
  EXPECT_EQ(roster.device(1).max_retries, 1) << "its own go before the line's";
  EXPECT_FALSE(roster.device(1).in_use);
  EXPECT_EQ(roster.everyone()[1]->device, &roster.device(1));
}

TEST(Roster, NoRoutesLeadToALineThatCarriesNoModbus) {
  const ToyMembers toys;
  EXPECT_EQ(toys.roster.carrier(), nullptr);
  EXPECT_EQ(toys.roster.FindSlave(1), nullptr);
}

TEST(Roster, EntriesOfOneNameAreTheSameOnTheWire) {
  ToyMembers toys;
  EXPECT_TRUE(toys.a.IsSame(toys.a));
  EXPECT_FALSE(toys.a.IsSame(toys.b)) << "nothing is known of their names";
  toys.a.sender = toys.b.sender = ToBytes("A");
  EXPECT_TRUE(toys.a.IsSame(toys.b));
}

}  // namespace
}  // namespace baudgate
