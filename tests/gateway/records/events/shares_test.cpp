// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "gateway/records/events/event_book.h"
#include "gateway/records/events/own_records.h"

namespace baudgate::events {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

EventRecord Port(const std::string& line, const std::string& text) {
  EventRecord record;
  record.line = line;
  record.code = CodeOf(OwnCode::port_down);
  record.text = text;
  return record;
}

class SharesTest : public ::testing::Test {
 protected:
  bool Take(const std::string& line, const std::string& text = "", bool room = true) {
    return shares_.Take(Port(line, text), room, now_.instant);
  }
  void Pass(Duration time) {
    now_.instant += time;
    now_.wall += time;
  }
  int Taken(const std::string& line, int events) {
    int taken = 0;
    for (int i = 0; i < events; ++i) taken += Take(line, std::to_string(i)) ? 1 : 0;
    return taken;
  }
  void Keep(const std::string& line, int events) {
    for (int i = 0; i < events; ++i) shares_.OnKept(Port(line, ""));
  }

  Now now_{Instant() + 1h, WallTime() + 1h};
  Shares shares_;
};

TEST_F(SharesTest, OfOneAreNotTakenFromAnother) {
  EXPECT_EQ(Taken("a", 1000), Shares::kAtOnce);
  EXPECT_EQ(Taken("b", 5), 5);
  EXPECT_EQ(shares_.left_out(), 1000U - Shares::kAtOnce);
}

TEST_F(SharesTest, TellHowManyAndTheLast) {
  Taken("a", 40);
  Keep("a", Shares::kAtOnce);
  EXPECT_THAT(shares_.TakeLeftOut(now_), IsEmpty());
  ASSERT_EQ(shares_.NextAt(), now_.instant + Shares::kSettles);
  Pass(Shares::kSettles);
  const auto told = shares_.TakeLeftOut(now_);
  ASSERT_EQ(told.size(), 2U);
  EXPECT_EQ(told[0].code, CodeOf(OwnCode::left_out));
  EXPECT_EQ(told[0].line, "a");
  EXPECT_THAT(told[0].text, HasSubstr("19 events"));
  EXPECT_EQ(told[1].code, CodeOf(OwnCode::port_down));
  EXPECT_EQ(told[1].text, "39");
  EXPECT_EQ(shares_.NextAt(), std::nullopt);
  EXPECT_FALSE(Take("a"));
  EXPECT_EQ(shares_.NextAt(), now_.instant + 2 * Shares::kSettles);
  Pass(2 * Shares::kSettles);
  EXPECT_EQ(shares_.TakeLeftOut(now_).size(), 1U) << "one alone is told as it is";
}

/// Every 2.5 s for an hour: more and more seldom, at last one a minute and a few.
TEST_F(SharesTest, WhatFlapsForLongDoesNotSettle) {
  Taken("a", Shares::kAtOnce);
  Keep("a", Shares::kAtOnce);
  std::size_t told = 0;
  for (Duration passed{}; passed < 1h; passed += 2500ms) {
    if (Take("a")) {
      ++told;
      Keep("a", 1);
    }
    Pass(2500ms);
    for (const EventRecord& one : shares_.TakeLeftOut(now_)) {
      told += one.code == CodeOf(OwnCode::port_down) ? 1 : 0;
      Keep("a", 1);
    }
  }
  EXPECT_LE(told, 65U);
}

/// That some were left out is no alarm, whatever they were.
TEST_F(SharesTest, WhatWasLeftOutRaisesNothing) {
  EventRecord flaps = Port("a", "on");
  flaps.subject = "a above 5";
  flaps.record = "trip";
  flaps.mark = {.step = AlarmMark::Step::raise, .priority = config::AlarmPriority::high};
  for (int i = 0; i < 40; ++i) shares_.Take(flaps, true, now_.instant);
  Pass(Shares::kEach);
  const auto told = shares_.TakeLeftOut(now_);
  ASSERT_EQ(told.size(), 2U);
  EXPECT_EQ(told[0].mark.step, AlarmMark::Step::none);
  EXPECT_EQ(told[0].record, "");
  EXPECT_EQ(told[1].mark.step, AlarmMark::Step::raise);
}

TEST_F(SharesTest, AreAllToldAtTheEnd) {
  Taken("a", 40);
  EXPECT_THAT(shares_.TakeLeftOut(now_), IsEmpty());
  const auto told = shares_.TakeLeftOut(now_, true);
  ASSERT_EQ(told.size(), 2U);
  EXPECT_EQ(told[1].text, "39");
}

TEST_F(SharesTest, AreWholeAgainAfterAWhile) {
  EXPECT_EQ(Taken("a", Shares::kAtOnce), Shares::kAtOnce);
  Keep("a", Shares::kAtOnce);
  Pass(Shares::kAtOnce * Shares::kEach);
  EXPECT_EQ(Taken("a", 100), Shares::kAtOnce);
}

/// While the disk fails nothing is kept, however long: memory has an end.
TEST_F(SharesTest, WaitInBoundedMemory) {
  int taken = 0;
  for (int minute = 0; minute < 10'000; ++minute, Pass(Shares::kEach)) taken += Take("a") ? 1 : 0;
  EXPECT_EQ(taken, Shares::kAtOnce);
  EXPECT_FALSE(Take("b", "last", false)) << "no room for anybody";
  Keep("a", Shares::kAtOnce);
  const auto told = shares_.TakeLeftOut(now_);
  ASSERT_EQ(told.size(), 3U);
  EXPECT_EQ(told[2].text, "last");
}

}  // namespace
}  // namespace baudgate::events
