// The text of T and D, and when they are due. Source of the texts: spa-bus reference, 5 and 13.
// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <ctime>

#include "protocols/spabus/clock.h"
#include "protocols/spabus/codec.h"
#include "tests/protocols/spabus/support.h"

namespace baudgate::protocols::spabus {
namespace {

WallTime At(std::int64_t seconds, Duration rest = {}) {
  return WallTime(std::chrono::seconds(seconds)) + rest;
}
constexpr std::int64_t kLeapDay = 1709251198;  // 2024-02-29 23:59:58 UTC

/// The machine's zone while it lives.
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

TEST(SpaClock, TellsTheSecondOfTheMinute) {
  EXPECT_EQ(ClockText(kSeconds, At(12, 345ms), Zone::utc), "12.345");
  EXPECT_EQ(ClockText(kSeconds, At(59, 999999999ns), Zone::utc), "59.999") << "never 60";
  EXPECT_EQ(ClockText(kSeconds, At(60), Zone::utc), "00.000");
}

TEST(SpaClock, TellsTheDateAsTheReferencePrintsIt) {
  EXPECT_EQ(ClockText(kDate, At(kLeapDay, 125ms), Zone::utc), "24-02-29 23.59;58.125");
  EXPECT_EQ(Encode(WriteOf(kBroadcast, {0, 'D', std::nullopt}, "24-02-29 23.59;58.125"), false),
            ToBytes(">900WD:24-02-29 23.59;58.125:36\r"));
  EXPECT_EQ(Encode(WriteOf(kBroadcast, {0, 'T', std::nullopt}, "12.345"), false),
            ToBytes(">900WT:12.345:1B\r"));
}

/// Central Europe: summer time began on 2026-03-29 at 01:00 UTC and ended on 2026-10-25 at 01:00.
TEST(SpaClock, CountsHoursInTheZoneThatWasChosen) {
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

}  // namespace
}  // namespace baudgate::protocols::spabus
