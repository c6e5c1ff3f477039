// What qualities and ages the values of a device have along its life, under virtual time.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "tests/gateway/bus/poller/poller_fixture.h"

namespace baudgate {
namespace {

TEST(Poller, AnOutageDoesNotMakeOldValuesLookYounger) {
  VirtualLine line(ToyLine({Polled(ToyDevice("a", "A", {"1", "2", "3"}), 1s)}), {&ToyProtocol()});
  line.Open();
  line.RunFor(5s);
  Quality best_when_old = Quality::bad;
  line.always = [&] {
    const auto age = line.AgeOf(0, 0);
    if (age && *age > 9s && best_when_old < line.QualityOf(0, 0)) {
      best_when_old = line.QualityOf(0, 0);
    }
  };
  line.twin(0).manner.dead = true;
  line.RunFor(15s);
  line.twin(0).manner.dead = false;
  line.RunFor(10s);
  EXPECT_TRUE(IsBad(best_when_old)) << "beyond dead_age of 9 s";
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
}

TEST(Poller, QualitiesAlongALife) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_not_connected) << "the port is not open yet";
  line.twin(0).manner.dead = true;
  line.Open();
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_waiting);
  line.RunFor(100ms);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_waiting);
  line.RunFor(10s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_communication) << "offline stands before never read";
  line.twin(0).manner.dead = false;
  line.RunFor(3s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
  line.twin(0).manner.dead = true;
  EXPECT_TRUE(line.RunUntil([&] { return line.QualityOf(0, 0) != Quality::good; }, 10s));
  line.RunFor(10s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_communication);
  line.Close();
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_not_connected);
  EXPECT_EQ(line.StatusOf(0).last_outcome, Outcome::line_down);
  line.twin(0).manner.dead = false;
  line.Open();
  EXPECT_NE(line.QualityOf(0, 0), Quality::good) << "not before it has been read again";
  line.RunFor(3s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
}

TEST(Poller, TroubleThatTheDeviceReportsIsNeverANumber) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
  line.twin(0).values.Set(0, 3.0);
  line.Open();
  line.RunFor(1500ms);
  ASSERT_EQ(line.QualityOf(0, 0), Quality::good);
  Say(line.twin(0), "fault");
  line.RunFor(1s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_sensor_failure);
  Say(line.twin(0), "nan");
  line.RunFor(1s);
  EXPECT_TRUE(IsBad(line.QualityOf(0, 0)));
  EXPECT_EQ(line.ValueOf(0, 0), Value(3.0)) << "the last good one";
  EXPECT_EQ(line.StatusOf(0).state, DeviceState::online) << "a bad channel is no bad device";
}

std::uint64_t SeqOf(VirtualLine& line, std::uint32_t point) {
  std::uint64_t seq = 0;
  line.store().Read(0, [&](const DeviceRecord& record) { seq = record.points[point].seq; });
  return seq;
}

/// What contradicts the profile concerns all points, those that are read once too.
TEST(Poller, ADeviceThatIsNotWhatItShouldBeHasNoGoodValue) {
  config::Device device = Polled(ToyDevice("a", "A", {"1", "2", "3"}), 1s);
  device.points[2].group = config::Group::once;
  VirtualLine line(ToyLine({device}), {&ToyProtocol()});
  line.Open();
  line.RunFor(3s);
  ASSERT_TRUE(IsGood(line.QualityOf(0, 2)));
  bool foreign = true;
  line.twin(0).manner.instead = [&](View request) -> std::optional<Bytes> {
    if (!foreign) return std::nullopt;
    return ToyReply(std::string(AsText(request).substr(1, 2)) + "~foreign");
  };
  line.RunFor(1s);
  bool good = false;
  line.always = [&] {
    good = good || IsGood(line.QualityOf(0, 0)) || IsGood(line.QualityOf(0, 2));
  };
  line.RunFor(3s);
  EXPECT_FALSE(good);
  for (std::uint32_t point = 0; point < 3; ++point) {
    EXPECT_EQ(line.QualityOf(0, point), Quality(Quality::bad_configuration, Reason::other_module));
  }
  EXPECT_EQ(line.StatusOf(0).trouble, "it is not A");
  EXPECT_EQ(std::count(line.warnings.begin(), line.warnings.end(), "it is not A"), 1);

  const std::uint64_t read_before = SeqOf(line, 2);
  line.always = [&] {
    // Good again only when it has been read again.
    const bool again = SeqOf(line, 2) > read_before;
    EXPECT_TRUE(again || !IsGood(line.QualityOf(0, 2)));
  };
  foreign = false;
  line.RunFor(3s);
  for (std::uint32_t point = 0; point < 3; ++point) EXPECT_TRUE(IsGood(line.QualityOf(0, point)));
  EXPECT_EQ(line.StatusOf(0).trouble, "");
}

}  // namespace
}  // namespace baudgate
