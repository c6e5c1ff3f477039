// Tests which samples `watch` prints, and their JSON.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/watch/watch_lines.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdlib>
#include <functional>
#include <limits>
#include <new>
#include <sstream>

#include "gateway/tools/watch/point_feed.h"
#include "gateway/tools/watch/point_image.h"
#include "gateway/tools/watch/restarting_child.h"

namespace baudgate::tools {
namespace {

PointEvent Reading() {
  PointEvent event;
  event.sample.value = 2.5;
  event.sample.quality = 0xC0;
  event.sample.seq = 7;
  return event;
}

TEST(WatchLines, DistinguishNewReadingsFromRepeats) {
  const struct {
    const char* what;
    std::function<void(PointEvent&)> change;
    bool same_reading;
    bool looks_alike;
  } rows[] = {
      {"a heartbeat", [](PointEvent&) {}, true, true},
      {"read once more", [](PointEvent& event) { event.sample.seq = 8; }, false, true},
      {"another value", [](PointEvent& event) { event.sample.value = 3; }, false, false},
      {"another text", [](PointEvent& event) { event.sample.text = "3"; }, false, false},
      {"another quality", [](PointEvent& event) { event.sample.quality = 0x18; }, false, false},
      {"gone", [](PointEvent& event) { event.gone = dds::Gone::no_writers; }, false, false},
  };
  for (const auto& row : rows) {
    PointEvent now = Reading();
    row.change(now);
    EXPECT_EQ(IsSameReading(Reading(), now), row.same_reading) << row.what;
    EXPECT_EQ(LooksAlike(Reading(), now), row.looks_alike) << row.what;
  }
  PointEvent unread;
  unread.sample.value = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(LooksAlike(unread, unread)) << "no value is no news either";
}

TEST(WatchLines, JsonHasEachFieldOfTheContract) {
  PointEvent event = Reading();
  event.sample.gateway = "g", event.sample.device = "d", event.sample.point = "p";
  event.sample.unit = "A", event.sample.rtt_us = 9;
  event.sample.source_time_ns = 1'790'000'000'000'000'000;
  const std::string end = R"(,"writer":")" + Text(event.origin.writer) + R"("})";
  EXPECT_EQ(JsonLine(event),
            R"({"gateway":"g","device":"d","point":"p","value":2.5,"unit":"A","quality":192,)"
            R"("quality_text":"good","source_time":"2026-09-21T14:13:20.000Z","seq":7,"rtt_us":9)" +
                end);
  event.gone = dds::Gone::no_writers;
  EXPECT_EQ(JsonLine(event), R"({"gateway":"g","device":"d","point":"p","gone":"no_writers"})");

  dds::EventSample happened;
  happened.gateway = "g", happened.device = "d", happened.seq = 412, happened.code = 49;
  happened.device_time_ns = 1'790'000'000'000'000'000, happened.text = "tripped";
  EXPECT_EQ(JsonLine(happened),
            R"({"gateway":"g","device":"d","seq":412,"device_time":"2026-09-21T14:13:20.000Z",)"
            R"("receive_time":null,"clock_quality":0,"channel":0,"code":49,"text":"tripped"})");

  dds::AlarmSample alarm;
  alarm.gateway = "g", alarm.line = "l", alarm.device = "d", alarm.name = "n";
  alarm.state = 3, alarm.priority = 3, alarm.seq = 412, alarm.text = "tripped";
  alarm.raised_time_ns = alarm.changed_time_ns = 1'790'000'000'000'000'000;
  EXPECT_EQ(JsonLine(alarm),
            R"({"gateway":"g","line":"l","device":"d","name":"n","point":"","state":"returned",)"
            R"("priority":"high","seq":412,"raised":"2026-09-21T14:13:20.000Z",)"
            R"("changed":"2026-09-21T14:13:20.000Z","text":"tripped","acknowledged_by":""})");
}

constexpr Duration kAtOnce[] = {Duration::zero()};

class SharedCount {
 public:
  SharedCount()
      : count_(new (::mmap(nullptr, sizeof(int), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS,
                           -1, 0)) int(0)) {}
  ~SharedCount() { ::munmap(count_, sizeof(int)); }
  SharedCount(const SharedCount&) = delete;
  SharedCount& operator=(const SharedCount&) = delete;
  int& operator*() const { return *count_; }

 private:
  int* count_;
};

TEST(Guarded, ReturnsTheExitCodeOfItsChild) {
  std::ostringstream err;
  EXPECT_EQ(RunGuarded([] { return 4; }, kAtOnce, err), 4);
  EXPECT_EQ(err.str(), "");
}

TEST(Guarded, RestartsADeadChild) {
  const SharedCount runs;
  std::ostringstream err;
  const auto run = [&runs] {
    const int number[] = {SIGABRT, SIGKILL};
    if (*runs < 2) ::raise(number[(*runs)++]);
    return 3;
  };
  EXPECT_EQ(RunGuarded(run, kAtOnce, err), 3);
  EXPECT_EQ(*runs, 2);
  EXPECT_EQ(err.str(),
            "watch: the process with the DDS library was ended by signal 6; watch restarts\n"
            "watch: the process with the DDS library was ended by signal 9; watch restarts\n");
}

TEST(Guarded, ForwardsTheStopSignal) {
  const SharedCount runs;
  std::ostringstream err;
  const auto run = [&runs] {
    ++*runs;
    ::kill(::getppid(), SIGTERM);
    for (;;) ::pause();
    return 0;
  };
  EXPECT_EQ(RunGuarded(run, kAtOnce, err), 128 + SIGTERM);
  EXPECT_EQ(*runs, 1);
  EXPECT_EQ(err.str(), "");
}

TEST(Listening, IsReopenedUntilItSucceeds) {
  dds::OwnAddresses own = {{"10.0.0.5", 2}};
  Status outcome;
  int opened = 0;
  Listening listening(
      {"10.0.0.5"},
      [&] {
        ++opened;
        return outcome;
      },
      [&] { return own; });
  ASSERT_TRUE(listening.Start());
  struct Row {
    Duration at;
    unsigned index;  ///< index of the interface; 0: no interface
    const char* outcome;
    std::string told;
    int opened;
  };
  const Row rows[] = {
      {1s, 2, "", "", 1},
      {2s, 0, "", "", 1},
      {2500ms, 7, "", "", 1},
      {3s, 7, "no room", "the interface of 10.0.0.5 was created again; no room", 2},
      {4s, 7, "no room", "", 3},
      {5s, 7, "no port", "no port", 4},
      {6s, 7, "", "watch restarts", 5},
      {7s, 7, "", "", 5},
      {8s, 9, "", "the interface of 10.0.0.5 was created again; watch restarts", 6},
  };
  for (const Row& row : rows) {
    own.clear();
    if (row.index != 0) own["10.0.0.5"] = row.index;
    const std::string wrong = row.outcome;
    outcome = wrong.empty() ? Status() : Status(Error{wrong});
    EXPECT_EQ(listening.Look(Instant(row.at)).value_or(""), row.told);
    EXPECT_EQ(listening.failure().value_or(""), wrong) << row.at.count();
    EXPECT_EQ(opened, row.opened);
  }
}

using ::testing::ElementsAre;

using Points = std::vector<std::string>;

PointOrder Order() {
  std::istringstream profiles(
      "voltage current_l1 current_l2 -reset\n"
      "current_l2 current_l1 energy -clear tariff\n"
      "clear reset_all -reset\n");
  return PointOrder(profiles);
}

Points Sorted(Points points, const PointOrder& order = Order()) {
  order.Sort(points);
  return points;
}

TEST(PointOrder, IsThatOfTheBestMatchingProfile) {
  EXPECT_THAT(Sorted({"current_l1", "current_l2", "voltage"}),
              ElementsAre("voltage", "current_l1", "current_l2"));
  EXPECT_THAT(Sorted({"current_l1", "current_l2", "energy"}),
              ElementsAre("current_l2", "current_l1", "energy"));
  EXPECT_THAT(Sorted({"current_l1", "current_l2"}), ElementsAre("current_l1", "current_l2"))
      << "the profile with the fewest others";
}

TEST(PointOrder, OtherPointsFollowInNaturalOrder) {
  EXPECT_THAT(Sorted({"input_10", "input_2", "voltage", "a"}),
              ElementsAre("voltage", "a", "input_2", "input_10"));
  EXPECT_THAT(Sorted({"p10", "p2", "p02", "p"}, {}), ElementsAre("p", "p02", "p2", "p10"));
}

TEST(PointOrder, RecognisesWriteOnlyPoints) {
  EXPECT_TRUE(Order().IsWriteOnly("reset"));
  EXPECT_FALSE(Order().IsWriteOnly("clear")) << "another profile reads it";
  EXPECT_FALSE(Order().IsWriteOnly("voltage"));
}

using ::testing::HasSubstr;
using ::testing::IsEmpty;

dds::PublisherId Id(char letter) {
  dds::PublisherId id;
  id.bytes.fill(static_cast<std::uint8_t>(letter));
  return id;
}

class Story {
 public:
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
  std::vector<std::string> Told() {
    for (const Remark& remark : publishers.TakeRemarks()) {
      if (remark.weight != Remark::Weight::note) told.push_back(remark.text);
    }
    return told;
  }

  Publishers publishers;
  std::vector<std::string> told;
};

TEST(Publishers, ASinglePublisherIsNotedWithoutAnAlarm) {
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

TEST(Publishers, ANewPublisherMayFollowALeftPublisher) {
  EXPECT_THAT(Story().Sample('A', 9, 0s).Left('A').Sample('B', 1, 1s).Tick(60s).Told(),
              ElementsAre(HasSubstr("took over from sender 41.")));
}

TEST(Publishers, ARestartWithinTheLeaseTakesOver) {
  Story story;
  story.Sample('A', 9, 0s).Sample('B', 1, 1s).Sample('B', 2, 2s);
  EXPECT_THAT(story.Told(), IsEmpty());
  EXPECT_THAT(story.Left('A').Tick(60s).Told(),
              ElementsAre(HasSubstr("took over from sender 41.")));
}

TEST(Publishers, AnEarlierSampleOfTheFirstPublisherIsNoAlarm) {
  Story story;
  story.Sample('A', 9, 0s).Sample('A', 9, 0s, "q").Sample('B', 1, 2s).Sample('A', 10, 1s, "q");
  EXPECT_THAT(story.Told(), IsEmpty());
}

TEST(Publishers, TwoActivePublishersRaiseOneAlarmAtOnce) {
  Story story;
  story.Sample('A', 9, 0s).Sample('B', 10, 1s).Sample('A', 11, 2s).Sample('B', 12, 3s);
  story.Sample('A', 13, 60s).Tick(90s);
  EXPECT_THAT(story.Told(), ElementsAre(HasSubstr("d p comes from two senders at once, 41.41")));
  EXPECT_EQ(story.publishers.Alarms().size(), 1U);
}

TEST(Publishers, ASilentFirstPublisherIsAnAlarmAfterTheLease) {
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
    EXPECT_THAT(story.Told(), ElementsAre(HasSubstr("took over from sender 41.")));
  }
}

TEST(Publishers, AReplacedPublisherThatSendsAgainIsAnAlarm) {
  Story story;
  story.Start('A', 100).Sample('A', 9, 0s).Start('B', 200).Sample('B', 1, 1s);
  story.Sample('A', 10, 2s).Sample('B', 2, 3s);
  EXPECT_THAT(story.Told(), ElementsAre(HasSubstr("took over"), HasSubstr("two senders at once")));
}

TEST(Publishers, ANewProcessWithTheSameStartTakesOverWhenTheOldLeaves) {
  Story story;
  story.Start('A', 100).Sample('A', 9, 0s).Start('B', 100).Sample('B', 10, 1s);
  EXPECT_THAT(story.Told(), IsEmpty());
  EXPECT_THAT(story.Left('A').Told(), ElementsAre(HasSubstr("took over")));
}

TEST(Publishers, AnAlarmEndsWhenAPublisherLeaves) {
  Story story;
  story.Sample('A', 9, 0s).Sample('B', 10, 1s).Sample('A', 11, 2s).Left('B');
  EXPECT_THAT(story.Told(), ElementsAre(HasSubstr("ALARM"), HasSubstr("has stopped")));
  EXPECT_THAT(story.publishers.Alarms(), IsEmpty());
}

TEST(Publishers, APublisherThatMayHaveLeftUnnoticedIsNoAlarm) {
  Story story;
  story.Start('A', 100).Sample('A', 9, 0s);
  story.publishers.OnDeaf();
  story.Start('B', 100).Sample('B', 10, 20s).Tick(60s);
  EXPECT_THAT(story.Told(), ElementsAre(HasSubstr("took over from sender 41.")));
}

TEST(Publishers, SeqMayJumpForwardButNotBack) {
  Story story;
  story.Sample('A', 9, 0s).Sample('A', 900, 1s);
  EXPECT_THAT(story.Told(), IsEmpty());
  story.Sample('A', 899, 2s).Sample('A', 5, 3s);
  EXPECT_THAT(story.Told(), ElementsAre(HasSubstr("(seq) of d p went back from 900 to 899")));
}

TEST(Publishers, SeqMayRestartWithALineOfAReload) {
  Story story;
  story.Sample('A', 48, 0s).Sample('A', 0, 1s).Sample('A', 1, 2s);
  EXPECT_THAT(story.Told(), IsEmpty());
  EXPECT_THAT(story.Sample('A', 48, 3s).Sample('A', 47, 4s).Told(),
              ElementsAre(HasSubstr("from 48 to 47")));
}

TEST(Publishers, SeqMayRestartAfterANewStart) {
  EXPECT_THAT(Story().Start('A', 100).Sample('A', 9, 0s).Start('A', 200).Sample('A', 1, 1s).Told(),
              IsEmpty());
}

}  // namespace
}  // namespace baudgate::tools
