// When a configuration on trial is given up.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/daemon/reload/trial.h"
#include "tests/support/times.h"

namespace baudgate::reload {
namespace {

using ::testing::HasSubstr;

struct TrialCase {
  const char* what;
  Health before;
  Duration after;             // of a trial of 60 s
  std::optional<Health> now;  // nothing: it is not configured any more
  const char* gives_up;       // "": it does not
};

TEST(Probation, LooksAtTimeAndDevices) {
  const TrialCase cases[] = {
      {"all is well", Health::well, 30s, Health::well, ""},
      {"the last moment", Health::well, 59s, Health::well, ""},
      {"nobody comes", Health::well, 60s, Health::well, "nobody has confirmed it in time"},
      {"gone bad", Health::well, 1s, Health::ill, "bay.a worked before, and does not any more"},
      {"bad before", Health::ill, 30s, Health::ill, ""},
      {"not asked yet", Health::well, 19s, Health::unknown, ""},
      {"not asked for long", Health::well, 20s, Health::unknown, "has not answered since"},
      {"not known before", Health::unknown, 59s, Health::unknown, ""},
      {"taken out of use", Health::well, 59s, Health::unasked, ""},
      {"out of use before", Health::unasked, 59s, Health::ill, ""},
      {"taken out", Health::well, 59s, std::nullopt, ""},
  };
  for (const TrialCase& one : cases) {
    Probation probation;
    probation.Begin(kStart, 60s, {{"bay.a", one.before}});
    Healths healths;
    if (one.now) healths = {{"bay.a", *one.now}};
    const auto why = probation.Look(kStart + one.after, healths);
    EXPECT_EQ(why.has_value(), *one.gives_up != '\0') << one.what;
    EXPECT_THAT(why.value_or(""), HasSubstr(one.gives_up)) << one.what;
    EXPECT_TRUE(probation.running()) << one.what;
  }
}

TEST(Probation, OfAShortTimeWaitsHalfOfIt) {
  Probation probation;
  probation.Begin(kStart, 4s, {{"bay.a", Health::well}});
  EXPECT_FALSE(probation.Look(kStart + 1999ms, {{"bay.a", Health::unknown}}));
  EXPECT_TRUE(probation.Look(kStart + 2s, {{"bay.a", Health::unknown}}));
}

TEST(Probation, ADeviceWhosePortWasLentHasTimeToBeAskedAgain) {
  Probation probation;
  probation.Begin(kStart, 60s, {{"bay.a", Health::well}});
  EXPECT_FALSE(probation.Look(kStart + 30s, {{"bay.a", Health::unasked}}));
  EXPECT_FALSE(probation.Look(kStart + 31s, {{"bay.a", Health::unknown}}));
  EXPECT_FALSE(probation.Look(kStart + 49s, {{"bay.a", Health::unknown}}));
  EXPECT_TRUE(probation.Look(kStart + 50s, {{"bay.a", Health::unknown}}));
}

// bay.a is asked again by the second, and its answer counts as that of the first would have.
TEST(Probation, ThatTakesThePlaceOfAnotherKnowsWhatWasWellBeforeThat) {
  Probation probation;
  probation.Begin(kStart, 60s, {{"bay.a", Health::well}});
  probation.Begin(kStart + 50s, 60s, {{"bay.a", Health::unknown}, {"bay.b", Health::well}});
  const auto look = [&](Duration after, Health a, Health b) {
    return probation.Look(kStart + after, {{"bay.a", a}, {"bay.b", b}}).value_or("");
  };
  EXPECT_EQ(look(69s, Health::unknown, Health::well), "");
  EXPECT_THAT(look(70s, Health::unknown, Health::well), HasSubstr("bay.a worked before"));
  EXPECT_THAT(look(60s, Health::well, Health::ill), HasSubstr("bay.b worked before"));
  EXPECT_EQ(look(109s, Health::well, Health::well), "");
  EXPECT_THAT(look(110s, Health::well, Health::well), HasSubstr("nobody has confirmed"));
  probation.End();
  probation.Begin(kStart, 60s, {});
  EXPECT_EQ(look(30s, Health::ill, Health::ill), "") << "of one that has ended nothing is known";
}

TEST(Probation, ThatHasEndedAsksForNothing) {
  Probation probation;
  EXPECT_FALSE(probation.running());
  EXPECT_FALSE(probation.Look(kStart, {}));
  probation.Begin(kStart, 60s, {{"bay.a", Health::well}});
  probation.End();
  EXPECT_FALSE(probation.Look(kStart + 1h, {{"bay.a", Health::ill}}));
}

}  // namespace
}  // namespace baudgate::reload
