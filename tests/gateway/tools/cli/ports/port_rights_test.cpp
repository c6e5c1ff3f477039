// Who may open a port, by the file's mode, and the command that mends it.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/tools/cli/ports/ports.h"

namespace baudgate {
namespace {

constexpr gid_t kDialout = 20;
const PortFile kUsual{"/dev/ttyUSB0", 0, kDialout, "dialout", 0660};
const Person kAnna{"anna", 1000, {1000}, false};
const Person kMember{"berta", 1001, {1001, kDialout}, false};
const Person kService{"baudgate", 990, {990, kDialout}, true};

TEST(PortRights, TheUsualPortIsForItsGroup) {
  EXPECT_TRUE(MayUse(kMember, kUsual));
  EXPECT_TRUE(MayUse(kService, kUsual));
  EXPECT_TRUE(MayUse({"root", 0, {0}, false}, kUsual));
  EXPECT_FALSE(MayUse(kAnna, kUsual));
  EXPECT_EQ(HowToMend(kAnna, kUsual),
            "you (anna) may not open /dev/ttyUSB0: sudo usermod -aG dialout anna, then log in "
            "again");
}

/// The first class that fits decides, even where a later one may do more.
TEST(PortRights, AsTheKernelDoes) {
  PortFile file = kUsual;
  file.mode = 0606;
  EXPECT_FALSE(MayUse(kMember, file));
  EXPECT_TRUE(MayUse(kAnna, file));
  file.owner = kAnna.id;
  file.mode = 0466;
  EXPECT_FALSE(MayUse(kAnna, file));
}

TEST(PortRights, AGroupThatMayNothingIsNoHelp) {
  PortFile file{"/dev/ttyACM0", 0, 0, "root", 0600};
  EXPECT_FALSE(MayUse(kService, file));
  EXPECT_EQ(HowToMend(kService, file),
            "the service (user baudgate) may not open /dev/ttyACM0: sudo chgrp dialout "
            "/dev/ttyACM0 && sudo chmod 660 /dev/ttyACM0; a udev rule makes it last");
}

TEST(PortRights, TheServiceIsGivenAnotherGroupByItsUnit) {
  const PortFile file{"/dev/ttyX0", 0, 42, "plant", 0660};
  EXPECT_FALSE(MayUse(kService, file));
  EXPECT_EQ(HowToMend(kService, file),
            "the service (user baudgate) may not open /dev/ttyX0: sudo systemctl edit baudgate, "
            "with [Service] and SupplementaryGroups=plant, then sudo systemctl restart baudgate");
}

}  // namespace
}  // namespace baudgate
