// Stories of publishers, told one event after the other: who may take over, and who is an alarm.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/tools/watch/point_image.h"

namespace baudgate {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// One letter is a publisher: A to Z.
dds::PublisherId Id(char letter) {
  dds::PublisherId id;
  id.bytes.fill(static_cast<std::uint8_t>(letter));
  return id;
}

class Story {
 public:
  /// `letter` publishes seq of the point, this time after the beginning.
  Story& Sample(char letter, std::uint64_t seq, Duration at, const char* point = "p") {
    dds::PointSample sample;
    sample.gateway = "g", sample.device = "d", sample.point = point, sample.seq = seq;
    dds::Origin origin;
    origin.writer.publisher = Id(letter);
    origin.received = WallTime(at);
    publishers.OnSample(sample, origin, Instant(at));
    return Tick(at);
  }
  Story& Start(char letter, std::int64_t seconds) {
    publishers.OnStart({"g", seconds * 1'000'000'000, "1"}, Id(letter));
    return *this;
  }
  Story& Left(char letter) { return publishers.OnLeft(Id(letter)), *this; }
  Story& Tick(Duration at) { return publishers.Tick(Instant(at)), *this; }
  /// Notes left out.
  std::vector<std::string> Told() {
    for (const Remark& remark : publishers.TakeRemarks()) {
      if (remark.weight != Remark::Weight::note) told.push_back(remark.text);
    }
    return told;
  }

  Publishers publishers;
  std::vector<std::string> told;
};

TEST(Publishers, OnePublisherIsANoteAndNoAlarm) {
  Story story;
  story.Sample('A', 1, 0s).Sample('A', 1, 10s).Sample('A', 900, 20s);
  const auto remarks = story.publishers.TakeRemarks();
  ASSERT_EQ(remarks.size(), 1U);
  EXPECT_THAT(remarks[0].text, HasSubstr("gateway g is published by 41.41."));
  EXPECT_THAT(story.publishers.Alarms(), IsEmpty());
}

TEST(Publishers, AStartIsNotedOnce) {
  Story story;
  story.Start('A', 1'700'000'000).Start('A', 1'700'000'000);
  const auto remarks = story.publishers.TakeRemarks();
  ASSERT_EQ(remarks.size(), 1U);
  EXPECT_THAT(remarks[0].text, HasSubstr("was started at 2023-11-14T22:13:20.000Z, version 1"));
}

TEST(Publishers, OneThatLeftMayBeFollowed) {
  EXPECT_THAT(Story().Sample('A', 9, 0s).Left('A').Sample('B', 1, 1s).Tick(60s).Told(),
              ElementsAre(HasSubstr("took over from 41.")));
}

TEST(Publishers, ARestartWithinTheLeaseTakesOver) {
  Story story;
  story.Sample('A', 9, 0s).Sample('B', 1, 1s).Sample('B', 2, 2s);
  EXPECT_THAT(story.Told(), IsEmpty());
  EXPECT_THAT(story.Left('A').Tick(60s).Told(), ElementsAre(HasSubstr("took over from 41.")));
}

TEST(Publishers, WhatTheFirstSentBeforeIsNoAlarm) {
  Story story;
  story.Sample('A', 9, 0s).Sample('A', 9, 0s, "q").Sample('B', 1, 2s).Sample('A', 10, 1s, "q");
  EXPECT_THAT(story.Told(), IsEmpty());
}

TEST(Publishers, TwoThatBothSpeakAreAnAlarmAtOnceAndOnce) {
  Story story;
  story.Sample('A', 9, 0s).Sample('B', 10, 1s).Sample('A', 11, 2s).Sample('B', 12, 3s);
  story.Sample('A', 13, 60s).Tick(90s);
  EXPECT_THAT(story.Told(), ElementsAre(HasSubstr("d p has two live writers, 41.41")));
  EXPECT_EQ(story.publishers.Alarms().size(), 1U);
}

TEST(Publishers, AFirstThatIsSilentButStaysIsAnAlarmAfterTheLease) {
  Story story;
  story.Sample('A', 9, 0s).Sample('B', 10, 1s).Tick(1s + Publishers::kRivalsMayGo - 1ms);
  EXPECT_THAT(story.Told(), IsEmpty());
  EXPECT_THAT(story.Tick(1s + Publishers::kRivalsMayGo).Told(), ElementsAre(HasSubstr("ALARM")));
}

TEST(Publishers, ANewerStartTakesOverAtOnce) {
  for (const bool start_comes_first : {true, false}) {
    Story story;
    story.Start('A', 100).Sample('A', 9, 0s).Sample('A', 9, 0s, "q");
    if (start_comes_first) story.Start('B', 200);
    story.Sample('B', 1, 1s).Start('B', 200).Sample('B', 1, 1s, "q").Tick(60s);
    EXPECT_THAT(story.Told(), ElementsAre(HasSubstr("took over from 41.")));
  }
}

TEST(Publishers, OneThatWasTakenOverAndSpeaksAgainIsAnAlarm) {
  Story story;
  story.Start('A', 100).Sample('A', 9, 0s).Start('B', 200).Sample('B', 1, 1s);
  story.Sample('A', 10, 2s).Sample('B', 2, 3s);
  EXPECT_THAT(story.Told(), ElementsAre(HasSubstr("took over"), HasSubstr("two live writers")));
}

TEST(Publishers, TheSameStartInANewProcessIsJudgedByWhoLeaves) {
  Story story;
  story.Start('A', 100).Sample('A', 9, 0s).Start('B', 100).Sample('B', 10, 1s);
  EXPECT_THAT(story.Told(), IsEmpty());
  EXPECT_THAT(story.Left('A').Told(), ElementsAre(HasSubstr("took over")));
}

TEST(Publishers, AnAlarmEndsWhenOneLeaves) {
  Story story;
  story.Sample('A', 9, 0s).Sample('B', 10, 1s).Sample('A', 11, 2s).Left('B');
  EXPECT_THAT(story.Told(), ElementsAre(HasSubstr("ALARM"), HasSubstr("has left")));
  EXPECT_THAT(story.publishers.Alarms(), IsEmpty());
}

TEST(Publishers, WhoMayHaveLeftUnheardIsNoRival) {
  Story story;
  story.Start('A', 100).Sample('A', 9, 0s);
  story.publishers.OnDeaf();
  story.Start('B', 100).Sample('B', 10, 20s).Tick(60s);
  EXPECT_THAT(story.Told(), ElementsAre(HasSubstr("took over from 41.")));
}

TEST(Publishers, SeqMayJumpForwardButNotBack) {
  Story story;
  story.Sample('A', 9, 0s).Sample('A', 900, 1s);
  EXPECT_THAT(story.Told(), IsEmpty());
  story.Sample('A', 899, 2s).Sample('A', 5, 3s);
  EXPECT_THAT(story.Told(), ElementsAre(HasSubstr("seq of d p went back from 900 to 899")));
}

TEST(Publishers, SeqBeginsAnewWithALineThatAReloadHasBegun) {
  Story story;
  story.Sample('A', 48, 0s).Sample('A', 0, 1s).Sample('A', 1, 2s);
  EXPECT_THAT(story.Told(), IsEmpty());
  EXPECT_THAT(story.Sample('A', 48, 3s).Sample('A', 47, 4s).Told(),
              ElementsAre(HasSubstr("from 48 to 47")));
}

TEST(Publishers, SeqBeginsAnewAfterANewStart) {
  EXPECT_THAT(Story().Start('A', 100).Sample('A', 9, 0s).Start('A', 200).Sample('A', 1, 1s).Told(),
              IsEmpty());
}

}  // namespace
}  // namespace baudgate
