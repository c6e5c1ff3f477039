// The judge itself: that every line of the runs is judged right while nothing is wrong, and that it
// sees a wrong point, a wrong device, an old value, a replaced device and an old setting.
// SPDX-License-Identifier: Apache-2.0
#include "tests/protocols/runs/birth_oracle.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/protocols/runs/lag_rig.h"

namespace baudgate {
namespace {

class Undisturbed : public ::testing::TestWithParam<LagCase> {};

TEST_P(Undisturbed, EverythingIsRightAndGood) {
  LagRig rig(GetParam(), 1);
  rig.Open();
  rig.oracle().RestartAvailability();
  for (int minute = 0; minute < 3; ++minute) {
    rig.RunFor(1min);
    for (std::uint32_t device = 0; device < rig.devices(); ++device) rig.Write(device);
  }
  rig.RunFor(20s);
  EXPECT_EQ(rig.oracle().wrong(), 0U) << rig.oracle().what();
  EXPECT_GT(rig.oracle().judged(), 150U);
  EXPECT_GT(rig.oracle().Availability(), 0.99);
  const bool writes = WritablePoint(rig->store().device(0)).has_value();
  EXPECT_EQ(rig.confirmed(), writes ? 6U : 0U);
}

INSTANTIATE_TEST_SUITE_P(Lines, Undisturbed, ::testing::ValuesIn(LagCases()), LagCaseName);

/// A store that a test fills by itself, and the judge of it.
class Judged {
 public:
  Judged() : rig(LagCaseOf("ModbusRtu19200", Queries::many, Proof::answered), 1) {
    rig->RunFor(200s);  // nothing is open: nobody else writes into the store
    now_ = rig->now();
  }

  /// What the judge says when point 0 of device 0 shows this value, read `age` ago.
  std::string Shows(double value, Duration age = {}) { return ShowsAt(0, value, age); }
  std::string ShowsAt(std::uint32_t point, double value, Duration age = {}) {
    const Sample sample{point, value, Quality::good};
    rig->store().SetOverride(0, std::nullopt);
    rig->store().Update(0, std::span(&sample, 1), {now_.instant - age, now_.wall - age}, 10ms);
    rig.oracle().Look();
    return rig.oracle().what();
  }
  double BornAt(std::size_t twin, std::size_t point, Duration ago = {}) {
    return ToDouble(rig->twin(twin).values.Get(point, now_.instant - ago));
  }

  LagRig rig;

 private:
  Now now_;
};

using ::testing::HasSubstr;

TEST(BirthOracle, AcceptsWhatIsNoMoreThanAPollOlderThanItsStamp) {
  Judged judged;
  EXPECT_EQ(judged.Shows(judged.BornAt(0, 0)), "");
  EXPECT_EQ(judged.Shows(judged.BornAt(0, 0, 1900ms)), "");
  EXPECT_EQ(judged.Shows(judged.BornAt(0, 0, 3s), 1500ms), "");
  EXPECT_THAT(judged.Shows(judged.BornAt(0, 0, 2100ms)), HasSubstr("older than its stamp"));
  EXPECT_EQ(judged.rig.oracle().wrong(), 1U);
  EXPECT_EQ(judged.rig.oracle().judged(), 4U);
}

TEST(BirthOracle, SeesAnotherPoint) {
  Judged judged;
  EXPECT_THAT(judged.Shows(judged.BornAt(0, 1)), HasSubstr("the value of twin 0, point 1"));
}

TEST(BirthOracle, SeesAnotherDevice) {
  Judged judged;
  EXPECT_THAT(judged.Shows(judged.BornAt(1, 0)), HasSubstr("the value of twin 1"));
}

TEST(BirthOracle, SeesNobodysValue) {
  Judged judged;
  EXPECT_THAT(judged.Shows(123456.5), HasSubstr("nobody's value"));
}

TEST(BirthOracle, KnowsWhoHasTakenThePlaceOfADevice) {
  Judged judged;
  judged.rig.oracle().Replace(0, 2, false);
  EXPECT_EQ(judged.Shows(judged.BornAt(2, 0)), "");
  judged.rig.oracle().Replace(0, 3, true);
  EXPECT_THAT(judged.Shows(judged.BornAt(3, 0)), HasSubstr("not the demanded one"));
}

TEST(BirthOracle, SeesValuesOfTwoDevicesAtOneAddress) {
  Judged judged;
  EXPECT_EQ(judged.Shows(judged.BornAt(0, 0)), "");
  judged.rig.oracle().Replace(0, 2, false);
  judged.rig.oracle().ForbidMixture(0);
  EXPECT_THAT(judged.ShowsAt(1, judged.BornAt(2, 1)), HasSubstr("of the replaced device"));
}

TEST(BirthOracle, SeesTheValueBeforeAConfirmedWrite) {
  Judged judged;
  const auto point = WritablePoint(judged.rig->store().device(0));
  ASSERT_TRUE(point);
  const double before = judged.BornAt(0, *point);
  EXPECT_EQ(judged.ShowsAt(*point, before), "");
  judged.rig->twin(0).values.Set(*point, 4711.0);
  judged.rig.oracle().Confirm(0, *point, 4711);
  judged.rig.oracle().Look();
  EXPECT_THAT(judged.rig.oracle().what(), HasSubstr("before the write that was confirmed"));
  EXPECT_EQ(judged.rig.oracle().wrong(), 1U);
}

TEST(BirthOracle, MeasuresTheShareOfGoodReadings) {
  Judged judged;
  const std::size_t points =
      judged.rig->store().device(0).points.size() + judged.rig->store().device(1).points.size();
  judged.rig.oracle().RestartAvailability();
  judged.Shows(judged.BornAt(0, 0));
  judged.rig->RunFor(0s);
  EXPECT_DOUBLE_EQ(judged.rig.oracle().Availability(), 1.0 / static_cast<double>(points));
}

}  // namespace
}  // namespace baudgate
