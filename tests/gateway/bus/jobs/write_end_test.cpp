// Tests of `WriteEndOf`, `VerdictOn` and `Compare`: the result of a write.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/bus/jobs/write.h"

namespace baudgate::bus {
namespace {

using config::Type;

TEST(WriteEndOf, AFailedWriteIsUnknownIfItWasSentElseNotSent) {
  for (const Outcome outcome : {Outcome::no_reply, Outcome::partial, Outcome::corrupt,
                                Outcome::unexpected, Outcome::line_down}) {
    EXPECT_EQ(WriteEndOf(outcome, true), WriteEnd::unknown) << Name(outcome);
    EXPECT_EQ(WriteEndOf(outcome, false), WriteEnd::not_sent) << Name(outcome);
  }
  for (const bool sent : {true, false}) {
    EXPECT_EQ(WriteEndOf(Outcome::ok, sent), sent ? WriteEnd::ok : WriteEnd::not_sent)
        << "what is ok without it is a step before it";
    EXPECT_EQ(WriteEndOf(Outcome::refused, sent), WriteEnd::refused);
    EXPECT_EQ(WriteEndOf(Outcome::unsupported, sent), WriteEnd::refused);
    EXPECT_EQ(WriteEndOf(Outcome::busy, sent), WriteEnd::busy);
  }
}

TEST(WriteEndOf, ARefusalOfADeviceThatMayHaveActedIsUnknown) {
  EXPECT_EQ(WriteEndOf(Outcome::refused, true, true), WriteEnd::unknown);
  EXPECT_EQ(WriteEndOf(Outcome::ok, true, true), WriteEnd::ok);
}

class Verdicts : public ::testing::Test {
 protected:
  Verdicts() {
    device_.points.resize(2);
    device_.points[0].name = "both";
    device_.points[1].access = config::Access::write;
    record_.device = {std::shared_ptr<void>(), &device_};
    record_.points.resize(2);
    confirmed_.at = Instant(1h);
    confirmed_.written = 1;
  }
  ReadBackVerdict Of(std::uint32_t point) {
    confirmed_.command.kind = Writes{{point, 5.0, 1.0, 5.0}};
    return VerdictOn(confirmed_, record_);
  }
  void Show(double value, Duration after, Quality quality = Quality::good) {
    record_.points[0].value = value;
    record_.points[0].reported = quality;
    record_.points[0].read_at = confirmed_.at + after;
  }

  config::Device device_;
  DeviceRecord record_;
  WriteQueue::Confirmed confirmed_;
};

TEST_F(Verdicts, OnlyAGoodReadingAfterTheWriteDecides) {
  EXPECT_TRUE(Of(0).lost) << "never read";
  Show(1.0, 0s);
  EXPECT_EQ(Of(0).result.end, WriteEnd::ok) << "from before";
  EXPECT_TRUE(Of(0).lost);
  Show(1.0, 1s, Quality::bad_sensor_failure);
  EXPECT_EQ(Of(0).result.end, WriteEnd::ok);
  Show(1.0, 1s);
  EXPECT_EQ(Of(0).result.end, WriteEnd::differs);
  Show(5.0, 1s);
  EXPECT_EQ(Of(0).result.end, WriteEnd::ok);
  EXPECT_TRUE(Of(0).result.read_back);
  EXPECT_FALSE(Of(0).lost);
}

TEST_F(Verdicts, AValueBetweenOldAndNewIsOkButNotReadBack) {
  Show(3.0, 1s);
  const ReadBackVerdict verdict = Of(0);
  EXPECT_EQ(verdict.result.end, WriteEnd::ok);
  EXPECT_FALSE(verdict.result.read_back);
  EXPECT_EQ(verdict.result.reason, "both shows 3");
  EXPECT_FALSE(verdict.lost);
}

TEST_F(Verdicts, AWriteOnlyPointIsOkWithoutAReadBack) {
  EXPECT_EQ(Of(1).result.end, WriteEnd::ok);
  EXPECT_FALSE(Of(1).result.read_back);
  EXPECT_FALSE(Of(1).lost);
}

struct Case {
  const char* what;
  Type type;
  Value before;
  Value written;
  Value shown;
  Comparison is;
};

constexpr std::int64_t I(int value) { return value; }

TEST(Comparison, ComparesTheReadBackWithTheWrittenValue) {
  const Case cases[] = {
      {"the same", Type::float32, 0.0, 30.3, 30.3, Comparison::written},
      {"as a float32", Type::float32, 0.0, 30.3, static_cast<double>(30.3F), Comparison::written},
      {"beyond a thousandth", Type::float32, 40.0, 30.34, 30.3, Comparison::another},
      {"within a thousandth", Type::float32, 0.0, 30.32, 30.3, Comparison::written},
      {"the old one", Type::float32, 10.0, 30.0, 10.0, Comparison::another},
      {"an output on its way up", Type::float32, 4.0, 20.0, 11.0, Comparison::between},
      {"and down", Type::float32, 20.0, 4.0, 11.0, Comparison::between},
      {"beyond", Type::float32, 4.0, 20.0, 21.0, Comparison::another},
      {"the way is not known", Type::float32, Value(), 20.0, 11.0, Comparison::another},
      {"zero", Type::float32, 5.0, 0.0, 0.0, Comparison::written},
      {"not zero", Type::float32, 0.0, 0.0, 0.1, Comparison::another},
      {"a whole number", Type::uint16, I(1), I(2), I(2), Comparison::written},
      {"never nearly", Type::uint16, I(1), I(2000), I(1999), Comparison::another},
      {"nor on its way", Type::uint16, I(1), I(3), I(2), Comparison::another},
      {"a bit", Type::boolean, false, true, true, Comparison::written},
      {"a bit that stays", Type::boolean, false, true, false, Comparison::another},
      {"a text", Type::string, std::string("a"), std::string("b"), std::string("b"),
       Comparison::written},
      {"another text", Type::string, std::string("a"), std::string("b"), std::string("a"),
       Comparison::another},
      {"nothing is shown", Type::float32, 1.0, 2.0, Value(), Comparison::nothing},
  };
  for (const Case& one : cases) {
    config::Point point;
    point.type = one.type;
    point.text_length = 8;
    EXPECT_EQ(Compare(point, {0, one.written, one.before, one.written}, one.shown), one.is)
        << one.what;
  }
}

TEST(Comparison, AValueRoundedToTheStepOrDecimalsCountsAsWritten) {
  config::Point point;
  point.type = Type::float32;
  const PointWrite write{0, 0.123, 5.0, 0.123};
  EXPECT_EQ(Compare(point, write, 0.12), Comparison::another);
  point.writing.decimals = 2;
  EXPECT_EQ(Compare(point, write, 0.12), Comparison::written);
  EXPECT_EQ(Compare(point, write, 0.11), Comparison::another);
  point.writing.decimals.reset();
  point.writing.step = 0.05;
  EXPECT_EQ(Compare(point, write, 0.1), Comparison::written);
}

/// Decimals apply to the value in the device: with a scale of 400 A, two decimals are steps of 4 A.
TEST(Comparison, DecimalsApplyToTheUnscaledValue) {
  config::Point point;
  point.type = Type::float32;
  point.scale = 400;
  point.writing.decimals = 2;
  const PointWrite write{0, 0.853, 0.5, 341.2};
  EXPECT_EQ(Compare(point, write, 340.0), Comparison::written) << "0.85";
  EXPECT_EQ(Compare(point, write, 344.0), Comparison::another) << "0.86";
}

TEST(Comparison, IntegersAreComparedInScaledUnits) {
  config::Point point;
  point.type = Type::int16;
  point.scale = 0.1;
  const PointWrite write{0, I(250), I(3), I(25)};
  EXPECT_EQ(Compare(point, write, I(25)), Comparison::written);
  EXPECT_EQ(Compare(point, write, I(3)), Comparison::another);
}

}  // namespace
}  // namespace baudgate::bus
