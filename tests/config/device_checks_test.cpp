// What the shipped protocols find wrong with a whole device, and where they say so.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "tests/config/fake_protocol.h"
#include "tests/config/shipped.h"

namespace baudgate::testing {
namespace {

std::string ProblemsOf(const std::string& protocol, const std::string& keys) {
  return Shown(config::LoadText("lines:\n- { name: l, port: /dev/l, protocol: " + protocol +
                                    ", devices: [\n  { name: d, address: 1, " + keys + " }] }\n",
                                "t.yaml", Shipped())
                   .problems);
}

TEST(DeviceChecks, Set4tmFindsAMalformedPasswordWithoutShowingIt) {
  const std::string expected =
      "t.yaml:3:3: error: device 'd': the password must be 6 ASCII characters, or 6 bytes as "
      "\"hex:01 02 03 04 05 06\"\n";
  for (const char* const bad : {"hunter22", "\"12345\"", "\"hex:01 02 03\"", "\"\""}) {
    EXPECT_EQ(ProblemsOf("set4tm", std::string("profile: set-4tm.02, password: ") + bad), expected)
        << bad;
  }
  for (const char* const good : {"hunter", "000000", "\"hex:01 02 03 04 05 06\""}) {
    EXPECT_EQ(ProblemsOf("set4tm", std::string("profile: set-4tm.02, password: ") + good), "")
        << good;
  }
}

TEST(DeviceChecks, DconFindsACodeWithTwoMeanings) {
  EXPECT_EQ(ProblemsOf("dcon", "profile: icpdas-i-7017, over: [\"+9\", \"+8\"], open: [\"+8\"]"),
            "t.yaml:3:3: error: device 'd': '+8' stands in 'over' and in 'open'; it can mean one "
            "of them only\n");
}

TEST(DeviceChecks, DconFindsAPointBeyondTheChannels) {
  EXPECT_EQ(
      ProblemsOf("dcon", "channels: 2, points: [{ name: third, read: \"#[2]\", type: float32 }]"),
      "t.yaml:3:3: error: device 'd': point 'third' reads '#[2]', but 'channels: 2' ends at "
      "[1]\n");
  EXPECT_EQ(
      ProblemsOf("dcon", "channels: 3, points: [{ name: third, read: \"#[2]\", type: float32 }]"),
      "");
  EXPECT_EQ(
      ProblemsOf("dcon", "channels: 2, points: [{ name: other, read: \"#2\", type: float32 }]"), "")
      << "one channel by its own command";
}

}  // namespace
}  // namespace baudgate::testing
