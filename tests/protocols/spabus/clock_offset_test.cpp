// How far a relay's clock is: the middle of what is known, and how sure that is.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/clock.h"
#include "tests/protocols/spabus/support.h"

namespace baudgate::protocols::spabus {
namespace {

constexpr Instant kSent{1h};
/// 12:00:00 of some day.
constexpr WallTime kNoon{std::chrono::hours(500'004)};
constexpr Duration kCharacter = 1ms;

ClockOffset::Offset OffsetOf(const std::string& said, WallTime arrives, Duration answered,
                             bool right = true) {
  ClockOffset offset;
  offset.OnAsked();
  offset.OnSent({kSent, arrives}, kCharacter);
  return offset.Of(said, 16, kSent + answered, right);
}

TEST(SpaClockOffset, IsAgainstTheMiddleOfTheTurnaround) {
  // The reply of 16 ms begins 20 ms behind the request.
  const auto ahead = OffsetOf("01.510", kNoon, 36ms);
  EXPECT_NEAR(ToDouble(ahead.value), 1.5, 1e-9);
  EXPECT_EQ(ahead.quality, Quality::good);
  EXPECT_NEAR(ToDouble(OffsetOf("59.010", kNoon, 36ms).value), -1, 1e-9);
  EXPECT_NEAR(ToDouble(OffsetOf("00.000", kNoon - 2ms, 20ms).value), 0, 1e-9);
}

TEST(SpaClockOffset, IsNeverMoreThanHalfAMinute) {
  EXPECT_NEAR(ToDouble(OffsetOf("30.000", kNoon, 16ms).value), 30, 1e-9);
  EXPECT_NEAR(ToDouble(OffsetOf("30.001", kNoon, 16ms).value), -29.999, 1e-9);
  EXPECT_NEAR(ToDouble(OffsetOf("00.500", kNoon + 59s, 16ms).value), 1.5, 1e-9);
  EXPECT_NEAR(ToDouble(OffsetOf("59.500", kNoon + 1s, 16ms).value), -1.5, 1e-9);
}

TEST(SpaClockOffset, IsUncertainWhereTheHostClockIsOrTheRelayWasSlow) {
  EXPECT_EQ(OffsetOf("01.510", kNoon, 36ms, false).quality, Quality::uncertain_sub_normal);
  EXPECT_EQ(OffsetOf("01.510", kNoon, 516ms).quality, Quality::good);
  EXPECT_EQ(OffsetOf("01.510", kNoon, 517ms).quality, Quality::uncertain_sub_normal);
  ClockOffset repeated;
  repeated.OnAsked();
  repeated.OnSent({kSent, kNoon}, kCharacter);
  repeated.OnSent({kSent + 1s, kNoon + 1s}, kCharacter);
  EXPECT_EQ(repeated.Of("01.000", 16, kSent + 1016ms, true).quality, Quality::uncertain_sub_normal)
      << "it may be the answer to the first request";
  repeated.OnAsked();
  repeated.OnSent({kSent + 2s, kNoon + 2s}, kCharacter);
  EXPECT_EQ(repeated.Of("02.000", 16, kSent + 2016ms, true).quality, Quality::good);
}

TEST(SpaClockOffset, OfWhatIsNoSecondIsNone) {
  for (const char* said : {"60.000", "-1", "", "12:34", "nan"}) {
    const auto offset = OffsetOf(said, kNoon, 36ms);
    EXPECT_FALSE(HasValue(offset.value)) << said;
    EXPECT_EQ(offset.quality, Quality::bad_configuration) << said;
  }
}

TEST(SpaClockOffset, IsAPoint) {
  Talk talk(SpabusProtocol(), MakeDevice({MakePoint("T offset"), MakePoint("I1")}));
  std::size_t query = 0;
  while (talk->Queries()[query].points.front() != 0) ++query;
  EXPECT_EQ(Body(Asked(talk, Poll(query))), ">1RT");
  Request request = talk.request();
  ASSERT_TRUE(request.stamped);
  talk->OnHostClock(true);
  talk->Stamp(request, {talk.now, kNoon}, kCharacter);
  EXPECT_EQ(request.bytes, talk.request().bytes);
  const Bytes odd = ReplyText("<1D:61.000:");
  EXPECT_EQ(talk->Check(request.bytes, odd), Outcome::unexpected);
  talk.now += 16ms;
  const Answer answer = Hear(talk, Poll(query), "<1D:02.000:");
  ASSERT_EQ(answer.outcome, Outcome::ok) << answer.reason;
  ASSERT_EQ(answer.readings.size(), 2U) << "and T as the item that it is";
  EXPECT_EQ(answer.readings.back().point, 0U);
  EXPECT_NEAR(ToDouble(answer.readings.back().value), 2, 1e-3);
  EXPECT_EQ(answer.readings.back().quality, Quality::good);
}

TEST(SpaClockOffset, IsReadOnlyAndANumber) {
  EXPECT_TRUE(SpabusProtocol().check_point(MakePoint("T offset")));
  EXPECT_FALSE(SpabusProtocol().check_point(MakePoint("T offset", Type::string)));
  EXPECT_FALSE(SpabusProtocol().check_point(
      MakePoint("T offset", Type::float32, Group::fast, Access::read_write)));
}

}  // namespace
}  // namespace baudgate::protocols::spabus
