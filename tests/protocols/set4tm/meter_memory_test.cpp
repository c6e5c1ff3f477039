// Serial numbers and refused passwords over restarts.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "protocols/set4tm/session.h"

namespace baudgate::protocols::set4tm {
namespace {

const Bytes kPassword = ToBytes("000000");

Now Earlier(Duration since) { return {Instant(5h) + since, WallTime(1'790'000'000s) + since}; }

/// Another process: its monotonic clock has nothing to do with the one before.
Now Later(Duration since) { return {Instant(7min) + since, WallTime(1'790'000'000s) + since}; }

TEST(MeterMemory, TheFirstMeterIsTheMeter) {
  MeterMemory memory(kPassword);
  memory.Recall("", Earlier(0s));
  EXPECT_EQ(memory.text(), "");
  memory.OnSerial(12345678);
  EXPECT_EQ(memory.text(), "serial 12345678");
  MeterMemory next(kPassword);
  next.Recall(memory.text(), Later(1min));
  EXPECT_EQ(next.serial(), 12345678U);
  next.OnEnabled();
  EXPECT_EQ(next.serial(), std::nullopt);
  EXPECT_EQ(next.text(), "");
}

TEST(MeterMemory, ARefusedPasswordIsTriedOnceMoreAfterAnHour) {
  MeterMemory memory(kPassword);
  memory.Recall("", Earlier(0s));
  EXPECT_TRUE(memory.MayTry(Earlier(0s).instant));
  memory.OnRefused(Earlier(0s).instant);
  EXPECT_FALSE(memory.MayTry(Earlier(59min).instant));
  EXPECT_EQ(memory.Wait(Earlier(20min).instant), 40min);
  EXPECT_TRUE(memory.MayTry(Earlier(60min).instant));
  memory.OnRefused(Earlier(60min).instant);
  EXPECT_FALSE(memory.MayTry(Earlier(48h).instant));
  EXPECT_TRUE(memory.given_up());
  memory.OnEnabled();
  EXPECT_TRUE(memory.MayTry(Earlier(48h).instant));
}

TEST(MeterMemory, RestartsDoNotCountAsPatience) {
  MeterMemory memory(kPassword);
  memory.Recall("", Earlier(0s));
  memory.OnRefused(Earlier(0s).instant);
  MeterMemory second(kPassword);
  second.Recall(memory.text(), Later(10min));
  EXPECT_FALSE(second.MayTry(Later(59min).instant));
  EXPECT_TRUE(second.MayTry(Later(61min).instant));
  second.OnRefused(Later(61min).instant);
  MeterMemory third(kPassword);
  third.Recall(second.text(), Later(72h));
  EXPECT_TRUE(third.given_up());
  EXPECT_FALSE(third.MayTry(Later(72h).instant));
}

TEST(MeterMemory, AnotherPasswordIsTriedAnew) {
  MeterMemory memory(ToBytes("secret"));
  memory.Recall("serial 5", Earlier(0s));
  memory.OnRefused(Earlier(0s).instant);
  memory.OnRefused(Earlier(1h).instant);
  EXPECT_EQ(memory.text().find("secret"), std::string::npos);
  MeterMemory next(ToBytes("123456"));
  next.Recall(memory.text(), Later(2h));
  EXPECT_TRUE(next.MayTry(Later(2h).instant));
  EXPECT_EQ(next.serial(), 5U) << "it is still that meter's place";
  EXPECT_EQ(next.text(), "serial 5");
}

TEST(MeterMemory, AClockThatWasSetBackGivesNoTryAway) {
  MeterMemory memory(kPassword);
  memory.Recall("", Earlier(0s));
  memory.OnRefused(Earlier(0s).instant);
  MeterMemory next(kPassword);
  const Now in_1970{Instant(7min), WallTime(30s)};
  next.Recall(memory.text(), in_1970);
  EXPECT_FALSE(next.MayTry(in_1970.instant + 59min));
  EXPECT_TRUE(next.MayTry(in_1970.instant + 60min));
}

TEST(MeterMemory, WhatItDoesNotUnderstandIsNothing) {
  for (const char* text : {"x", "serial", "serial -1", "serial 99999999999", "password", ";;;",
                           "password ZZ refused 1", "password 00 refused x y", "serial 1 2"}) {
    MeterMemory memory(kPassword);
    memory.Recall(text, Earlier(0s));
    EXPECT_EQ(memory.serial(), std::nullopt) << text;
    EXPECT_TRUE(memory.MayTry(Earlier(0s).instant)) << text;
  }
}

TEST(MeterMemory, KeepsNothingWhereNothingCanBeKept) {
  MeterMemory memory(kPassword);
  memory.OnSerial(5);
  memory.OnRefused(Instant(1h));
  EXPECT_EQ(memory.text(), "");
  EXPECT_EQ(memory.serial(), 5U);
}

}  // namespace
}  // namespace baudgate::protocols::set4tm
