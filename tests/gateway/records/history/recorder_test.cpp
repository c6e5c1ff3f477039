// Tests of `Recorder` with simulated clocks: which values are stored, and when.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/history/recorder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "gateway/records/history/batch.h"

namespace baudgate::history {
namespace {

using ::testing::ElementsAre;

class RecorderTest : public ::testing::Test {
 protected:
  RecorderTest() {
    config::Line line;
    line.name = "bay";
    config::Device device;
    device.name = "f1";
    for (const char* name : {"a", "b", "c"}) {
      config::Point point;
      point.name = name;
      point.type = config::Type::float64;
      device.points.push_back(point);
    }
    line.devices.push_back(device);
    config_.lines.push_back(line);
    config_.history.points = {{.device = 0, .point = 0}, {.device = 0, .point = 2}};
    store_ = std::make_unique<bus::PointStore>(config_);
    feed_ = store_->Subscribe();
    recorder_ = std::make_unique<Recorder>(config_.history, *store_, now_);
  }

  void Pass(Duration time) {
    now_.instant += time;
    now_.wall += time;
  }
  void Set(std::uint32_t point, double value, Quality quality = Quality::good) {
    const Sample_ sample{point, value, quality};
    store_->Update(0, {&sample, 1}, now_, 1ms);
  }
  void Take(std::size_t room = 1000) {
    bus::Changes changes;
    feed_->Drain({}, changes);
    recorder_->Take(changes, now_, room, out_);
  }
  /// Returns texts such as "1/0@5000=10": run, point, ms since kBegin, value.
  std::vector<std::string> Kept() const {
    std::vector<std::string> texts;
    for (const Sample& sample : out_.samples) {
      texts.push_back(std::to_string(sample.run) + "/" + std::to_string(sample.point) + "@" +
                      std::to_string(sample.entry.time - kBegin) + "=" +
                      ToText(sample.entry.value));
    }
    return texts;
  }

  using Sample_ = bus::Sample;
  static constexpr Millis kBegin = 1'790'000'040'000;
  Now now_{Instant(1h), ToWall(kBegin)};
  config::Config config_;
  std::unique_ptr<bus::PointStore> store_;
  std::shared_ptr<bus::ChangeFeed> feed_;
  std::unique_ptr<Recorder> recorder_;
  Batch out_;
};

TEST_F(RecorderTest, ContinuesAfterADeviceIsForgotten) {
  Set(0, 1);
  store_->Retire(0);
  store_->Forget(0);
  Take();
  EXPECT_THAT(Kept(), testing::IsEmpty());
}

TEST_F(RecorderTest, KeepsChangesOfTheChosenPoints) {
  Set(0, 1);
  Set(1, 7);
  Take();
  Pass(1s);
  Set(0, 1);
  Set(2, 5);
  Pass(5ms);
  Take();
  Pass(1s);
  Set(0, 2);
  Take();
  EXPECT_THAT(Kept(), ElementsAre("1/0@0=1", "1/1@1000=5", "1/0@2005=2"));
  EXPECT_EQ(recorder_->counters().readings, 4U);
  EXPECT_EQ(recorder_->counters().merged, 0U);
}

TEST_F(RecorderTest, CountsMergedReadings) {
  for (int i = 0; i < 5; ++i) Set(0, i);
  Take();
  EXPECT_EQ(recorder_->counters().merged, 4U);
}

TEST_F(RecorderTest, KeepsQualityWithoutAValue) {
  Set(0, 1);
  Take();
  Pass(1s);
  store_->SetOverride(0, Quality(Quality::bad_communication));
  Take();
  ASSERT_EQ(out_.samples.size(), 3U) << "the other point, too";
  EXPECT_EQ(out_.samples[1].entry.quality, Quality::bad_communication);
  EXPECT_FALSE(HasValue(out_.samples[1].entry.value));
  EXPECT_EQ(out_.samples[1].entry.time, kBegin + 1000);
}

TEST_F(RecorderTest, AFullQueueIsAGap) {
  Set(0, 1);
  Take();
  Pass(1s);
  Set(0, 2);
  Take(1);
  Pass(1s);
  Set(0, 3);
  Take(1);
  EXPECT_THAT(Kept(), ElementsAre("1/0@0=1"));
  EXPECT_EQ(recorder_->counters().dropped, 2U);
  EXPECT_EQ(out_.runs.back().until, kBegin + 1000) << "until the first that was dropped";
  out_ = {};
  for (int n = 0; n < 10; ++n) {
    Pass(1s);
    recorder_->Tick(now_, 0, out_);
  }
  Take(1000);
  EXPECT_THAT(Kept(), ElementsAre("2/0@12000=3")) << "anew, what is known";
  ASSERT_EQ(out_.runs.size(), 2U);
  EXPECT_EQ(out_.runs[0].until, kBegin + 1000);
  EXPECT_EQ(out_.runs[1].began, kBegin + 12'000);
  EXPECT_EQ(out_.runs[1].why, RunBegin::dropped);
}

TEST_F(RecorderTest, AClockStepBeginsANewRun) {
  Set(0, 1);
  Take();
  for (const Duration step : {Duration(-1h), Duration(2h)}) {
    Pass(1s);
    now_.wall += step;
    Take();
  }
  EXPECT_THAT(Kept(), ElementsAre("1/0@0=1", "2/0@-3599000=1", "3/0@3602000=1"));
  ASSERT_EQ(out_.runs.size(), 3U);
  EXPECT_EQ(out_.runs[0].until, kBegin + 1000) << "by the clock as it was";
  EXPECT_EQ(out_.runs[1].began, kBegin - 3'599'000);
  EXPECT_EQ(out_.runs[1].until, kBegin - 3'598'000);
  EXPECT_EQ(out_.runs[2].why, RunBegin::clock);
  Pass(1s);
  Set(0, 2);
  Take();
  EXPECT_EQ(Kept().back(), "3/0@3603000=2");
}

/// The program stands still after SIGSTOP, in a suspend, or on a virtual machine without a
/// processor.
TEST_F(RecorderTest, AStandstillOfTheProgramIsAGap) {
  Set(0, 10);
  Set(2, 20);
  Take();
  Pass(1s);
  recorder_->Tick(now_, 1000, out_);
  Pass(15s);
  recorder_->Tick(now_, 1000, out_);
  ASSERT_EQ(out_.runs.size(), 2U);
  EXPECT_EQ(out_.runs[0].until, kBegin + 1000);
  EXPECT_EQ(out_.runs[1].why, RunBegin::standstill);
  EXPECT_EQ(out_.runs[1].began, kBegin + 16000);
  EXPECT_THAT(Kept(), ElementsAre("1/0@0=10", "1/1@0=20", "2/0@16000=", "2/1@16000="))
      << "by now they are too old to be good";
  Pass(1s);
  recorder_->End(now_, out_);
  Millis good = 0;
  for (const TrendRow& trend : out_.trends) {
    if (trend.point == 0 && trend.width == kMinute) good += trend.trend.good;
  }
  EXPECT_EQ(good, 1000);
}

TEST_F(RecorderTest, TrendsIncludeEveryReading) {
  config_.history.points.clear();
  for (int i = 0; i < 90; ++i) {
    Set(0, i % 2 == 0 ? 1 : 2);
    Take();
    Pass(1s);
    recorder_->Tick(now_, 1000, out_);
  }
  ASSERT_EQ(out_.trends.size(), 1U);
  EXPECT_EQ(out_.trends[0].trend, (Trend{kBegin, 1.5, 1, 2, 1, 2, 60, kMinute}));
  out_.trends.clear();
  recorder_->End(now_, out_);
  ASSERT_EQ(out_.trends.size(), 2U) << "the rest of the minute, and of the hour";
  EXPECT_EQ(out_.trends[0].trend.good, 30 * kSecond);
  EXPECT_EQ(out_.trends[1].width, kHour);
  EXPECT_EQ(out_.trends[1].trend.count, 90);
  EXPECT_EQ(out_.runs.back().until, kBegin + 90 * kSecond);
}

constexpr LogRule kPlain{};
const LogRule kHalf{.deadband = 0.5};
constexpr LogRule kEvery{.every = true};
constexpr double kInfinite = std::numeric_limits<double>::infinity();
const Quality kGood = Quality::good;
const Quality kOld = Quality::uncertain_last_usable;
const Quality kSilent = Quality::bad_communication;
const Quality kOpen = {Quality::bad_sensor_failure, Reason::open_sensor};

struct Row {
  const char* why;
  LogRule rule;
  Value from;
  Quality was;
  Value to;
  Quality is;
  Millis later;
  bool kept;
};

const Row kRows[] = {
    {"the same", kPlain, 1.0, kGood, 1.0, kGood, 1000, false},
    {"any change", kPlain, 1.0, kGood, 1.0000001, kGood, 1000, true},
    {"within the deadband", kHalf, 10.0, kGood, 10.4, kGood, 1000, false},
    {"just the deadband", kHalf, 10.0, kGood, 10.5, kGood, 1000, false},
    {"beyond it", kHalf, 10.0, kGood, 10.6, kGood, 1000, true},
    {"beyond it, downwards", kHalf, 10.0, kGood, 9.4, kGood, 1000, true},
    {"whole numbers, too", kHalf, std::int64_t{1}, kGood, std::int64_t{2}, kGood, 1000, true},
    {"a switch within a deadband", LogRule{.deadband = 2}, false, kGood, true, kGood, 1000, false},
    {"text has no deadband", kHalf, std::string("a"), kGood, std::string("b"), kGood, 1000, true},
    {"the same text", kHalf, std::string("a"), kGood, std::string("a"), kGood, 1000, false},
    {"from infinite to itself", kHalf, kInfinite, kGood, kInfinite, kGood, 1000, false},
    {"from infinite", kHalf, kInfinite, kGood, 1.0, kGood, 1000, true},
    {"quality within the deadband", kHalf, 1.0, kGood, 1.0, kOld, 1, true},
    {"quality back", kHalf, 1.0, kOld, 1.0, kGood, 1, true},
    {"another reason", kHalf, Value(), kSilent, Value(), kOpen, 1, true},
    {"bad as before", kPlain, Value(), kSilent, Value(), kSilent, 1000, false},
    {"before max_gap", kPlain, 1.0, kGood, 1.0, kGood, 10 * kMinute - 1, false},
    {"at max_gap", kPlain, 1.0, kGood, 1.0, kGood, 10 * kMinute, true},
    {"bad at max_gap", kPlain, Value(), kSilent, Value(), kSilent, 10 * kMinute, true},
    {"every reading", kEvery, 1.0, kGood, 1.0, kGood, 1, true},
};

TEST(LogRule, DecidesWhichChangesAreKept) {
  for (const Row& row : kRows) {
    const Entry last{5000, row.from, row.was};
    const Entry now{5000 + row.later, row.to, row.is};
    EXPECT_EQ(IsKept(row.rule, &last, now), row.kept) << row.why;
    EXPECT_TRUE(IsKept(row.rule, nullptr, now)) << row.why;
  }
}

using testing::IsEmpty;
using testing::SizeIs;

Batch Of(std::int64_t run, Millis began, Millis until, std::vector<Millis> times) {
  Batch batch;
  batch.runs = {{.number = run, .began = began, .until = until}};
  for (const Millis time : times) {
    batch.samples.push_back({.run = run, .entry = {.time = time, .value = 1.0}});
  }
  return batch;
}

TEST(PendingValues, ContinueTheRunsOfTheFiles) {
  PendingValues pending;
  EXPECT_FALSE(pending.has_begun());
  pending.Begin(40);
  pending.Add(Of(1, 100, 200, {100}));
  ASSERT_THAT(pending.batch().runs, SizeIs(1));
  EXPECT_EQ(pending.batch().runs[0].number, 41);
  EXPECT_EQ(pending.batch().samples[0].run, 41);
  EXPECT_FALSE(pending.TakeLost());
}

TEST(PendingValues, BeginANewRunAfterTheirFileIsLost) {
  PendingValues pending;
  pending.Begin(40);
  pending.Add(Of(1, 100, 200, {150}));
  pending.CutRun();
  pending.Add(Of(1, 100, 300, {250}));
  ASSERT_THAT(pending.batch().runs, SizeIs(1));
  EXPECT_EQ(pending.batch().runs[0].number, 42);
  EXPECT_EQ(pending.batch().runs[0].began, 150) << "nothing is known of the time before";
  EXPECT_EQ(pending.batch().runs[0].until, 300);
  EXPECT_EQ(pending.batch().runs[0].why, RunBegin::dropped);
  EXPECT_EQ(pending.batch().samples[1].run, 42);
  EXPECT_TRUE(pending.TakeLost());
  EXPECT_FALSE(pending.TakeLost());
}

TEST(BatchQueue, HasSeparatePlacesForSamplesAndTrends) {
  BatchQueue queue(3);
  EXPECT_EQ(queue.Add(Of(1, 0, 200, {100, 101})), 0U);
  EXPECT_EQ(queue.Room(), 1U);
  Batch spans;
  spans.trends.resize(2);
  EXPECT_EQ(queue.Add(Batch(spans)), 0U);
  EXPECT_EQ(queue.Add(Batch(spans)), 2U) << "the queue has room for one of them only";
  const Batch all = queue.TakeAll();
  EXPECT_THAT(all.samples, SizeIs(2));
  EXPECT_THAT(all.trends, SizeIs(2));
  EXPECT_EQ(queue.Room(), 3U);
  EXPECT_THAT(queue.TakeAll().samples, IsEmpty());
}

}  // namespace
}  // namespace baudgate::history
