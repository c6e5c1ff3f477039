// Tests the text of the messages T and D, and when they are due (SPA Bus reference, 5 and 13).
// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <ctime>

#include "protocols/common/identification.h"
#include "protocols/spabus/clock.h"
#include "protocols/spabus/codec.h"
#include "tests/protocols/spabus/support.h"

namespace baudgate::protocols::spabus {
namespace {

WallTime At(std::int64_t seconds, Duration rest = {}) {
  return WallTime(std::chrono::seconds(seconds)) + rest;
}
constexpr std::int64_t kLeapDay = 1709251198;

/// Sets the time zone of the process during the lifetime of the object.
class Zoned {
 public:
  explicit Zoned(const char* zone) {
    setenv("TZ", zone, 1);
    tzset();
  }
  ~Zoned() {
    unsetenv("TZ");
    tzset();
  }
};

TEST(SpaClock, SendsTheSecondOfTheMinute) {
  EXPECT_EQ(ClockText(kSeconds, At(12, 345ms), Zone::utc), "12.345");
  EXPECT_EQ(ClockText(kSeconds, At(59, 999999999ns), Zone::utc), "59.999") << "never 60";
  EXPECT_EQ(ClockText(kSeconds, At(60), Zone::utc), "00.000");
}

TEST(SpaClock, SendsTheDateInTheFormOfTheReference) {
  EXPECT_EQ(ClockText(kDate, At(kLeapDay, 125ms), Zone::utc), "24-02-29 23.59;58.125");
  EXPECT_EQ(Encode(WriteOf(kBroadcast, {0, 'D', std::nullopt}, "24-02-29 23.59;58.125"), false),
            ToBytes(">900WD:24-02-29 23.59;58.125:36\r"));
  EXPECT_EQ(Encode(WriteOf(kBroadcast, {0, 'T', std::nullopt}, "12.345"), false),
            ToBytes(">900WT:12.345:1B\r"));
}

/// Central Europe: summer time began on 2026-03-29 and ended on 2026-10-25, both at 01:00 UTC.
TEST(SpaClock, UsesTheChosenZone) {
  const Zoned zone("CET-1CEST,M3.5.0,M10.5.0/3");
  constexpr std::int64_t kSpring = 1774746000;
  constexpr std::int64_t kAutumn = 1792890000;
  const auto text = [](std::int64_t time, Zone in) { return ClockText(kDate, At(time), in); };
  EXPECT_EQ(text(kSpring - 1, Zone::local), "26-03-29 01.59;59.000");
  EXPECT_EQ(text(kSpring, Zone::local), "26-03-29 03.00;00.000");
  EXPECT_EQ(text(kSpring, Zone::standard), "26-03-29 02.00;00.000");
  EXPECT_EQ(text(kSpring, Zone::utc), "26-03-29 01.00;00.000");
  EXPECT_EQ(text(kAutumn - 1, Zone::local), "26-10-25 02.59;59.000");
  EXPECT_EQ(text(kAutumn, Zone::local), "26-10-25 02.00;00.000");
  EXPECT_EQ(text(kAutumn - 1, Zone::standard), "26-10-25 01.59;59.000");
}

TEST(SpaClock, IsDueByItsPeriodsAndOnlyWithARightClock) {
  const ClockSettings both{.seconds = 10s, .date = 1min};
  ClockMessages clock;
  const Instant start{};
  EXPECT_EQ(clock.Due(both, start), std::nullopt) << "nobody has said that the clock is right";
  clock.OnHostClock(true);
  EXPECT_EQ(clock.Due({}, start), std::nullopt) << "not asked for";
  EXPECT_EQ(clock.Due(both, start), kDate);
  clock.OnSent(kDate, start);
  EXPECT_EQ(clock.Due(both, start), kSeconds);
  clock.OnSent(kSeconds, start);
  EXPECT_EQ(clock.Due(both, start + 9s), std::nullopt);
  EXPECT_EQ(clock.Due(both, start + 10s), kSeconds);
  EXPECT_EQ(clock.Due(both, start + 60s), kDate);
  clock.OnHostClock(false);
  EXPECT_EQ(clock.Due(both, start + 2min), std::nullopt);
  clock.OnSent(kSeconds, start + 2min);
  clock.OnHostClock(true);
  EXPECT_EQ(clock.Due(both, start + 2min), kDate) << "at once, when it is right again";
}

constexpr Instant kSent{1h};
constexpr WallTime kNoon{std::chrono::hours(500'004)};
constexpr Duration kCharacter = 1ms;

ClockOffset::Offset OffsetOf(const std::string& said, WallTime arrives, Duration answered,
                             bool right = true) {
  ClockOffset offset;
  offset.OnAsked();
  offset.OnSent({kSent, arrives}, kCharacter);
  return offset.Of(said, 16, kSent + answered, right);
}

TEST(SpaClockOffset, IsMeasuredAtTheMiddleOfTheTurnaround) {
  // The reply ends 36 ms after the request, and takes 16 ms, so it begins after 20 ms.
  const auto ahead = OffsetOf("01.510", kNoon, 36ms);
  EXPECT_NEAR(ToDouble(ahead.value), 1.5, 1e-9);
  EXPECT_EQ(ahead.quality, Quality::good);
  EXPECT_NEAR(ToDouble(OffsetOf("59.010", kNoon, 36ms).value), -1, 1e-9);
  EXPECT_NEAR(ToDouble(OffsetOf("00.000", kNoon - 2ms, 20ms).value), 0, 1e-9);
}

TEST(SpaClockOffset, IsAtMostHalfAMinute) {
  EXPECT_NEAR(ToDouble(OffsetOf("30.000", kNoon, 16ms).value), 30, 1e-9);
  EXPECT_NEAR(ToDouble(OffsetOf("30.001", kNoon, 16ms).value), -29.999, 1e-9);
  EXPECT_NEAR(ToDouble(OffsetOf("00.500", kNoon + 59s, 16ms).value), 1.5, 1e-9);
  EXPECT_NEAR(ToDouble(OffsetOf("59.500", kNoon + 1s, 16ms).value), -1.5, 1e-9);
}

TEST(SpaClockOffset, IsUncertainWithAnUncertainHostClockOrASlowRelay) {
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

TEST(SpaClockOffset, HasNoValueForAnInvalidSecond) {
  for (const char* said : {"60.000", "-1", "", "12:34", "nan"}) {
    const auto offset = OffsetOf(said, kNoon, 36ms);
    EXPECT_FALSE(HasValue(offset.value)) << said;
    EXPECT_EQ(offset.quality, Quality::bad_configuration) << said;
  }
}

TEST(SpaClockOffset, IsReadAsAPoint) {
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

// ---------------- Only a relay that reports the configured designation has good values. Texts: SPA
// reference, F of SPCJ 4D29 and SPAU 130 C.

config::Device Relay() {
  config::Device device = MakeDevice({MakePoint("I1"), MakePoint("S1")}, "1");
  device.identity.names = {"SPCJ 4D29", "SPAJ 140 C"};
  device.identity.others = {{"SPAU130C", "spau130c"}};
  return device;
}

TEST(Designation, OnlyANameListedByAnotherProfileIsAContradiction) {
  config::Identity identity = Relay().identity;
  EXPECT_EQ(JudgeName(identity, " SPAJ 140C").text, "");
  EXPECT_EQ(JudgeName(identity, "spcj 4d29").text, "");
  const DeviceTrouble foreign = JudgeName(identity, "SPAU 130 C");
  EXPECT_EQ(foreign.reason, Reason::other_module);
  EXPECT_NE(foreign.text.find("set profile: spau130c"), std::string::npos) << foreign.text;
  const DeviceTrouble unknown = JudgeName(identity, "SPAJ 140 X");
  EXPECT_FALSE(unknown);
  EXPECT_NE(unknown.text.find("does not list (SPCJ 4D29, SPAJ 140 C)"), std::string::npos)
      << unknown.text;
  identity.ignore = true;
  EXPECT_EQ(JudgeName(identity, "SPAU 130 C").text, "");
  EXPECT_EQ(JudgeName({}, "anything").text, "");
}

TEST(SpaDesignation, IsReadAndComparedBeforeTheFirstPoll) {
  Talk talk(SpabusProtocol(), Relay());
  EXPECT_EQ(Asked(talk, Poll(0)), ">1RF:21");
  const Answer foreign = Hear(talk, Poll(0), "<1D:SPAU 130 C:");
  EXPECT_EQ(foreign.then, Then::replan);
  EXPECT_TRUE(foreign.readings.empty());
  EXPECT_EQ(talk->trouble().reason, Reason::other_module);
  ASSERT_EQ(talk->Queries().size(), 1U);
  EXPECT_EQ(talk->Queries()[0].group, config::Group::slow);

  talk->OnReconnect();
  EXPECT_TRUE(talk->trouble()) << "until it is known to be right";
  EXPECT_EQ(Asked(talk, Poll(0)), ">1RF:21");
  EXPECT_EQ(Hear(talk, Poll(0), "<1D:SPCJ 4D29:").then, Then::replan);
  EXPECT_FALSE(talk->trouble());
  EXPECT_EQ(talk->Queries().size(), 2U);
  EXPECT_NE(Asked(talk, Poll(0)), ">1RF:21");
}

TEST(SpaDesignation, SilenceAndRefusalAreNoContradiction) {
  for (const char* reply : {"", "<1N:6:"}) {
    Talk talk(SpabusProtocol(), Relay());
    const Bytes wire = *reply == '\0' ? Bytes() : ReplyText(reply);
    const bool silent = wire.empty();
    EXPECT_EQ(talk.Exchange(Poll(0), View(wire)).then, silent ? Then::done : Then::ask_again);
    EXPECT_NE(Asked(talk, Poll(0)), ">1RF:21");
    EXPECT_FALSE(talk->trouble());
  }
}

TEST(SpaDesignation, AFailureOfAnotherTaskDoesNotReplaceItsReply) {
  Talk talk(SpabusProtocol(), Relay());
  EXPECT_EQ(Asked(talk, Poll(0)), ">1RF:21");
  Asked(talk, Probe());
  talk.Fail(Probe(), Outcome::no_reply);
  EXPECT_EQ(Asked(talk, Poll(0)), ">1RF:21");

  config::Device guarded = Relay();
  guarded.points.push_back(MakePoint("V150", Type::uint16, Group::slow, Access::read_write));
  guarded.options.Set("password", std::int64_t{345});
  Talk writes(SpabusProtocol(), std::move(guarded));
  Asked(writes, Poll(0));
  Asked(writes, Write(2, Value(std::int64_t{1})));
  EXPECT_EQ(writes.Fail(Write(2, Value(std::int64_t{1})), Outcome::no_reply), Then::ask_again);
  EXPECT_EQ(Body(Asked(writes, Write(2, Value(std::int64_t{1})))), ">1WV161:345");
}

}  // namespace
}  // namespace baudgate::protocols::spabus
