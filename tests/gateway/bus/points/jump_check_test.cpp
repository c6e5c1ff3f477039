// Tests of `JumpCheck`, which checks readings of one point in succession.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string>

#include "gateway/bus/points/readings.h"

namespace baudgate::bus {
namespace {

using config::Recheck;
using config::Type;

config::Point PointOf(Recheck recheck, Type type = Type::float64) {
  config::Point point;
  point.name = "p";
  point.type = type;
  point.recheck = recheck;
  return point;
}

class JumpCheckTest : public ::testing::Test {
 protected:
  void Use(const config::Point& point) {
    points_ = {point};
    check_.emplace(points_);
  }

  /// Returns how the reading is stored: "counts", "uncertain" or "-" (not stored). " again" is
  /// added if the point must be read again, " doubt" if the stored value becomes uncertain.
  std::string Read(const Value& value, Quality quality = Quality::good) {
    std::vector<Sample> samples = {{0, value, quality}};
    const JumpCheck::Result result = check_->Check(samples);
    std::string said = samples.empty()                            ? "-"
                       : samples[0].quality == Quality::uncertain ? "uncertain"
                                                                  : "counts";
    if (!samples.empty()) {
      EXPECT_EQ(samples[0].value, value);
    }
    if (result.ask_again) said += " again";
    if (!result.doubtful.empty()) said += " doubt";
    return said;
  }

  std::vector<config::Point> points_;
  std::optional<JumpCheck> check_;
};

TEST_F(JumpCheckTest, TheFirstReadingNeedsASecondReading) {
  Use(PointOf(Recheck::jump));
  EXPECT_EQ(Read(20.0), "- again doubt");
  EXPECT_EQ(Read(20.1), "counts");
  EXPECT_EQ(Read(21.9), "counts") << "within a tenth";
}

/// Example: in one reply, a balance reports a new state and that its weight is not stable.
TEST_F(JumpCheckTest, AChangeDuringAnUncertainReadingIsNotDamage) {
  Use(PointOf(Recheck::jump, Type::boolean));
  const auto read = [this](bool stable, bool certain) {
    std::vector<Sample> samples = {{0, stable, Quality::good}};
    if (!certain) samples.push_back({1, 99.5, Quality::uncertain});
    return check_->Check(samples).unconfirmed;
  };
  points_.push_back(PointOf(Recheck::off));
  check_.emplace(points_);
  read(true, true);
  read(true, true);
  EXPECT_FALSE(read(false, false));
  EXPECT_FALSE(read(true, true)) << "it was not certain before";
  read(false, true);
  EXPECT_TRUE(read(true, true));
}

TEST_F(JumpCheckTest, OnlyAJumpThatReturnsIsUnconfirmed) {
  Use(PointOf(Recheck::jump));
  const auto unconfirmed = [this](double value) {
    std::vector<Sample> samples = {{0, value, Quality::good}};
    return check_->Check(samples).unconfirmed;
  };
  unconfirmed(20.0), unconfirmed(20.0);
  for (const double value : {30.0, 40.0, 50.0, 62.0, 75.0}) EXPECT_FALSE(unconfirmed(value));
  unconfirmed(75.0);
  EXPECT_FALSE(unconfirmed(12.0));
  EXPECT_TRUE(unconfirmed(75.0)) << "it is back";
}

TEST_F(JumpCheckTest, TheThresholdIsATenthOfAConfiguredRange) {
  config::Point point = PointOf(Recheck::jump);
  point.writing.min = -100;
  point.writing.max = 100;
  Use(point);
  Read(0.0), Read(0.0);
  EXPECT_EQ(Read(19.0), "counts");
  EXPECT_EQ(Read(40.0), "- again doubt");
}

TEST_F(JumpCheckTest, ADamagedReadingIsNeverShown) {
  Use(PointOf(Recheck::jump));
  Read(20.0), Read(20.0);
  EXPECT_EQ(Read(84.5), "- again doubt");
  EXPECT_EQ(Read(20.6), "counts");
  EXPECT_EQ(Read(84.5), "- again doubt") << "what was damage before is no proof now";
  EXPECT_EQ(Read(20.0), "counts");
}

TEST_F(JumpCheckTest, ATrueJumpCountsAtTheSecondReading) {
  Use(PointOf(Recheck::jump));
  Read(20.0), Read(20.0);
  EXPECT_EQ(Read(84.5), "- again doubt");
  EXPECT_EQ(Read(84.4), "counts");
  EXPECT_EQ(Read(84.5), "counts");
}

TEST_F(JumpCheckTest, TheLastOfThreeDisagreeingReadingsIsUncertain) {
  Use(PointOf(Recheck::jump));
  Read(84.4), Read(84.4);
  EXPECT_EQ(Read(12.0), "- again doubt");
  EXPECT_EQ(Read(55.0), "- again doubt");
  EXPECT_EQ(Read(71.0), "uncertain");
  EXPECT_EQ(Read(30.0), "uncertain") << "and no request more than the polls";
  EXPECT_EQ(Read(30.5), "counts") << "calm again";
  EXPECT_EQ(Read(60.0), "- again doubt");
}

TEST_F(JumpCheckTest, TheConfiguredJumpOfThePointIsTheThreshold) {
  config::Point point = PointOf(Recheck::jump);
  point.jump = 5;
  Use(point);
  Read(20.0), Read(20.0);
  EXPECT_EQ(Read(25.0), "counts");
  EXPECT_EQ(Read(30.1), "- again doubt");
}

TEST_F(JumpCheckTest, TheLargestValueSeenSetsTheMinimumThreshold) {
  Use(PointOf(Recheck::jump));
  Read(400.0), Read(400.0);
  EXPECT_EQ(Read(0.0), "- again doubt");
  EXPECT_EQ(Read(0.0), "counts");
  EXPECT_EQ(Read(3.9), "counts") << "1 % of 400";
  EXPECT_EQ(Read(-0.2), "- again doubt") << "4.1 away";
}

TEST_F(JumpCheckTest, BitsAndTextsJumpWithEveryChange) {
  Use(PointOf(Recheck::jump, Type::boolean));
  Read(false), Read(false);
  EXPECT_EQ(Read(true), "- again doubt");
  EXPECT_EQ(Read(true), "counts");
  Use(PointOf(Recheck::jump, Type::string));
  Read(std::string("7017")), Read(std::string("7017"));
  EXPECT_EQ(Read(std::string("7018")), "- again doubt");
  EXPECT_EQ(Read(std::string("7017")), "counts");
}

TEST_F(JumpCheckTest, AlwaysModeNeedsTwoReadingsEachTime) {
  Use(PointOf(Recheck::always));
  EXPECT_EQ(Read(20.0), "- again doubt");
  EXPECT_EQ(Read(20.0), "counts");
  EXPECT_EQ(Read(20.1), "- again") << "near the last one, which stays good";
  EXPECT_EQ(Read(20.1), "counts");
  EXPECT_EQ(Read(20.1), "- again");
}

TEST_F(JumpCheckTest, UncheckedAndFaultyReadingsCountAtOnce) {
  Use(PointOf(Recheck::off));
  EXPECT_EQ(Read(20.0), "counts");
  EXPECT_EQ(Read(9000.0), "counts");
  Use(PointOf(Recheck::jump));
  EXPECT_EQ(Read(Value(), Quality::bad_sensor_failure), "counts");
  Read(20.0), Read(20.0);
  EXPECT_EQ(Read(Value(), Quality::bad_sensor_failure), "counts");
  EXPECT_EQ(Read(20.0), "counts") << "as before the fault";
}

TEST_F(JumpCheckTest, AWrittenValueCountsAsTheFirstReading) {
  Use(PointOf(Recheck::jump, Type::boolean));
  Read(false), Read(false);
  check_->OnWritten(0, true);
  EXPECT_EQ(Read(true), "counts");
  check_->OnWritten(0, false);
  EXPECT_EQ(Read(true), "counts") << "the device has not done it: the last value is read again";
}

TEST_F(JumpCheckTest, APointSeldomReadIsReadAgainWhenItsThreeReadingsDisagree) {
  using config::Group;
  for (const Group group : {Group::once, Group::daily, Group::slow, Group::fast}) {
    config::Point point = PointOf(Recheck::jump);
    point.group = group;
    Use(point);
    std::vector<Sample> samples;
    JumpCheck::Result result;
    for (const double value : {10.0, 50.0, 90.0}) {
      samples = {{0, value, Quality::good}};
      result = check_->Check(samples);
    }
    const bool seldom = group == Group::once || group == Group::daily;
    EXPECT_EQ(result.spoils, seldom ? std::optional(group) : std::nullopt);
    EXPECT_FALSE(result.ask_again);
  }
}

}  // namespace
}  // namespace baudgate::bus
