// Whether silence to a request tells of the device, or of what was asked.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/bus/devices/device_health.h"

namespace baudgate {
namespace {

const std::vector<std::size_t> kHeard = {0, 1};
const std::vector<std::size_t> kNever = {2, 3};
constexpr Instant kStart{100s};

TEST(HeardPoints, SilenceToWhatWasAnsweredTellsOfTheDevice) {
  HeardPoints points;
  EXPECT_TRUE(points.TellsOfDevice(kNever, kStart)) << "nothing has ever come";
  points.OnValue(1, kStart);
  EXPECT_TRUE(points.TellsOfDevice(kHeard, kStart + 1s));
  EXPECT_FALSE(points.TellsOfDevice(kNever, kStart + 1s));
}

TEST(HeardPoints, LongBehindTheLastValueSoDoesSilenceToTheRest) {
  HeardPoints points;
  points.OnValue(0, kStart);
  EXPECT_FALSE(points.TellsOfDevice(kNever, kStart + 10s));
  EXPECT_TRUE(points.TellsOfDevice(kNever, kStart + 11s));
  points.OnValue(0, kStart + 12s);
  EXPECT_FALSE(points.TellsOfDevice(kNever, kStart + 13s));
}

TEST(HeardPoints, TheSilenceOfADeviceThatIsLateTellsOfIt) {
  HeardPoints points;
  points.OnLate(kStart);
  points.OnValue(0, kStart + 1s);
  EXPECT_TRUE(points.TellsOfDevice(kNever, kStart + 2s));
  points.OnValue(0, kStart + 11min);
  EXPECT_FALSE(points.TellsOfDevice(kNever, kStart + 11min));
}

TEST(HeardPoints, BehindAReconnectItMayBeAnotherDevice) {
  HeardPoints points;
  points.OnValue(0, kStart);
  points.Clear();
  EXPECT_TRUE(points.TellsOfDevice(kNever, kStart));
}

}  // namespace
}  // namespace baudgate
