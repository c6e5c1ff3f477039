// Tests of `SampleSender` under virtual time, with a writer that only records.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "gateway/base/version.h"
#include "gateway/outputs/dds/publisher.h"
#include "tests/gateway/outputs/dds/fixture.h"
#include "tests/gateway/outputs/dds/remembering_writer.h"

namespace baudgate::dds {
namespace {

using ::testing::ElementsAre;
using testing::MakeConfig;
using ::testing::Pair;
using testing::RememberingWriter;
using ::testing::SizeIs;

struct Sending {
  explicit Sending(config::Config made) : config(std::move(made)), store(config) {}

  void Set(std::uint32_t device, std::uint32_t point, Value value,
           Quality quality = Quality::good) {
    const bus::Sample sample{point, std::move(value), quality};
    store.Update(device, std::span(&sample, 1), now, 5ms);
  }
  void RunFor(Duration time) {
    const Instant end = now.instant + time;
    for (;;) {
      bus::Changes changes;
      if (sender.idle()) {
        feed->Drain(Instant(), changes);
        sender.Add(changes);
      }
      const Instant next = sender.Send(now.instant);
      if (next > end) break;
      Pass(std::max(Duration(0), next - now.instant));
    }
    Pass(end - now.instant);
  }
  void Pass(Duration time) {
    now.instant += time;
    now.wall += time;
  }
  Now now{Instant() + 1h, WallTime(77s)};
  const config::Config config;
  bus::PointStore store;
  std::shared_ptr<bus::ChangeFeed> feed = store.Subscribe();
  RememberingWriter writer;
  std::vector<std::pair<log::Level, std::string>> lines;
  SampleSender sender{
      config, store, writer,
      [this](log::Level level, const std::string& line) { lines.emplace_back(level, line); }, now};
};

TEST(SampleSender, SendsTheStartTimeOncePerSession) {
  Sending run(MakeConfig(1, 1));
  run.Pass(3s);
  run.RunFor(30s);
  ASSERT_THAT(run.writer.gateways, SizeIs(1));
  const GatewaySample told = run.writer.gateways.front();
  EXPECT_EQ(told.gateway, "substation-7");
  EXPECT_EQ(told.start_time_ns, 77'000'000'000);
  EXPECT_EQ(told.version, kVersion);
  run.sender.StartAnew(run.now.instant);
  run.RunFor(30s);
  EXPECT_THAT(run.writer.gateways, ElementsAre(told, told)) << "the start is the gateway's";
}

TEST(SampleSender, RetriesTheStartTimeWhenTheWriterRefusesIt) {
  for (const Sent answer : {Sent::later, Sent::refused}) {
    Sending run(MakeConfig(1, 1));
    run.writer.answer = answer;
    run.RunFor(5s);
    EXPECT_THAT(run.writer.gateways, SizeIs(0));
    run.writer.answer = Sent::yes;
    run.RunFor(1s);
    EXPECT_THAT(run.writer.gateways, SizeIs(1));
  }
}

TEST(SampleSender, StartsWithAnImageThatWaitsForData) {
  Sending run(MakeConfig(2, 3));
  run.RunFor(1ms);
  ASSERT_THAT(run.writer.points, SizeIs(6));
  ASSERT_THAT(run.writer.devices, SizeIs(2));
  const PointSample& sample = *run.writer.Latest("p2");
  EXPECT_EQ(sample.gateway, "substation-7");
  EXPECT_EQ(sample.quality, 0x20);
  EXPECT_TRUE(std::isnan(sample.value));
  EXPECT_EQ(sample.text, "");
  EXPECT_EQ(sample.unit, "A");
  EXPECT_EQ(sample.source_time_ns, 0);
  EXPECT_EQ(sample.seq, 0U);
  EXPECT_EQ(run.writer.devices.front().line, "bay");
  EXPECT_EQ(run.writer.devices.front().last_ok_time_ns, 0);
}

TEST(SampleSender, ALongImageWaitsForExistingSubscribersToConnect) {
  Sending run(MakeConfig(1, 1001));
  run.RunFor(499ms);
  EXPECT_THAT(run.writer.points, SizeIs(0));
  run.RunFor(1s);
  EXPECT_THAT(run.writer.points, SizeIs(1001));
}

TEST(SampleSender, LimitsItsRateToTheSocketBuffers) {
  Sending run(MakeConfig(10, 100));
  run.RunFor(10ms);
  EXPECT_LE(run.writer.points.size(), 300U) << "100 at once, then 20 a millisecond";
  EXPECT_GE(run.writer.points.size(), 200U);
  EXPECT_FALSE(run.sender.idle());
  run.RunFor(100ms);
  EXPECT_THAT(run.writer.points, SizeIs(1000));
  EXPECT_TRUE(run.sender.idle());
}

TEST(SampleSender, AChangedPointDoesNotWaitForTheWholeImage) {
  Sending run(MakeConfig(10, 100));
  run.RunFor(5ms);
  run.Set(9, 99, 2.5);
  run.RunFor(8ms);
  EXPECT_LT(run.writer.points.size(), 500U);
  const auto sent = [](const PointSample& s) { return s.device == "feeder-9" && s.value == 2.5; };
  EXPECT_EQ(std::ranges::count_if(run.writer.points, sent), 1);
}

TEST(SampleSender, SendsAReadingWithItsTimeAndRoundTrip) {
  Sending run(MakeConfig(1, 2));
  run.Set(0, 1, 2.5, Quality::uncertain_sub_normal);
  run.RunFor(0ms);
  const PointSample& sample = *run.writer.Latest("p1");
  EXPECT_EQ(sample.seq, 1U);
  EXPECT_EQ(sample.value, 2.5);
  EXPECT_EQ(sample.quality, 0x58);
  EXPECT_EQ(sample.rtt_us, 5000U);
  EXPECT_EQ(sample.source_time_ns, 77'000'000'000);
}

TEST(SampleSender, SendsTextVisiblyBounded) {
  Sending run(MakeConfig(1, 1));
  run.Set(0, 0, std::string(200, 'x'));
  run.RunFor(0ms);
  const PointSample& sample = *run.writer.Latest("p0");
  EXPECT_EQ(sample.seq, 1U);
  EXPECT_TRUE(std::isnan(sample.value));
  EXPECT_EQ(sample.text.size(), kMaxText);
  EXPECT_THAT(sample.text, ::testing::EndsWith("x\u2026"));
}

TEST(SampleSender, AChangeOfQualityIsSentWithinTheDeadband) {
  config::Config config = MakeConfig(1, 1);
  config.lines[0].devices[0].points[0].deadband = 1000;
  Sending run(std::move(config));
  run.Set(0, 0, 2.5);
  run.RunFor(0ms);
  run.Set(0, 0, 3.5);
  run.RunFor(0ms);
  EXPECT_THAT(run.writer.points, SizeIs(1)) << "within the deadband";
  run.store.SetOverride(0, Quality::bad_not_connected);
  run.RunFor(0ms);
  ASSERT_THAT(run.writer.points, SizeIs(2));
  EXPECT_EQ(run.writer.points[1].quality, 0x08);
  EXPECT_EQ(run.writer.points[1].value, 3.5);
}

TEST(SampleSender, AnAgedPointIsSentWithoutANewReading) {
  Sending run(MakeConfig(1, 1));
  run.Set(0, 0, 2.5);
  run.RunFor(0ms);
  EXPECT_EQ(run.writer.Latest("p0")->quality, 0xC0);
  run.Pass(1h);
  run.store.Age(run.now.instant);
  run.RunFor(0ms);
  EXPECT_EQ(run.writer.Latest("p0")->seq, 1U);
  EXPECT_EQ(run.writer.Latest("p0")->quality, 0x18);
}

TEST(SampleSender, TheHeartbeatRepeatsUnchangedPoints) {
  config::Config config = MakeConfig(1, 4);
  config.dds.heartbeat = 10s;
  Sending run(std::move(config));
  run.RunFor(1min);
  EXPECT_GE(run.writer.points.size(), 4U * 7);
  EXPECT_LE(run.writer.points.size(), 4U * 9) << "three quarters of the heartbeat at the least";
}

TEST(SampleSender, DeviceStatusCarriesCountersAndState) {
  Sending run(MakeConfig(1, 1));
  run.store.UpdateStatus(0, [](bus::DeviceStatus& status) {
    status.state = bus::DeviceState::online;
    status.last_outcome = Outcome::corrupt;
    status.last_ok = Instant(1s);
    status.last_ok_wall = WallTime(77s);
    status.exchanges = 10;
    status.outcomes[static_cast<std::size_t>(Outcome::ok)] = 7;
    status.outcomes[static_cast<std::size_t>(Outcome::no_reply)] = 2;
    status.outcomes[static_cast<std::size_t>(Outcome::corrupt)] = 1;
    status.retries = 3;
    status.round_trips.Add(4ms);
  });
  run.RunFor(0ms);
  ASSERT_THAT(run.writer.devices, SizeIs(1));
  const DeviceSample& sample = run.writer.devices.back();
  EXPECT_EQ(sample.state, 1);
  EXPECT_EQ(sample.last_outcome, 4);
  EXPECT_EQ(sample.last_ok_time_ns, 77'000'000'000);
  EXPECT_EQ(sample.exchanges, 10U);
  EXPECT_EQ(sample.ok, 7U);
  EXPECT_EQ(sample.no_reply, 2U);
  EXPECT_EQ(sample.corrupt, 1U);
  EXPECT_EQ(sample.retries, 3U);
  EXPECT_EQ(sample.rtt_mean_us, 4000U);
  EXPECT_GE(sample.rtt_p99_us, 4000U);
}

TEST(SampleSender, ChangingCountersAreSentOnceASecond) {
  Sending run(MakeConfig(1, 1));
  for (int i = 0; i < 100; ++i) {
    run.store.UpdateStatus(0, [](bus::DeviceStatus& status) { ++status.exchanges; });
    run.RunFor(100ms);
  }
  EXPECT_GE(run.writer.devices.size(), 10U);
  EXPECT_LE(run.writer.devices.size(), 11U);
}

TEST(SampleSender, RepeatsRefusedSamplesAndLogsThemOnce) {
  Sending run(MakeConfig(1, 20));
  run.RunFor(10ms);
  ASSERT_THAT(run.writer.points, SizeIs(20));
  run.writer.answer = Sent::refused;
  for (std::uint32_t point = 0; point < 20; ++point) run.Set(0, point, 1.0);
  run.RunFor(10ms);
  EXPECT_EQ(run.sender.counters().failed, 20U);
  run.writer.answer = Sent::yes;
  run.RunFor(2s);
  for (int point = 0; point < 20; ++point) {
    EXPECT_EQ(run.writer.Latest("p" + std::to_string(point))->value, 1.0);
  }
  EXPECT_THAT(
      run.lines,
      ElementsAre(Pair(log::Level::warning,
                       "DDS has refused a sample of device feeder-0; the gateway sends it again"),
                  Pair(log::Level::info,
                       "DDS accepts samples again; 20 samples were refused and sent again")));
}

TEST(SampleSender, SendsTheLatestValueWhenTheWriterHasRoomAgain) {
  Sending run(MakeConfig(2, 2));
  run.RunFor(1ms);
  run.writer.points.clear();
  run.writer.answer = Sent::later;
  for (int i = 1; i <= 50; ++i) {
    run.Set(1, 1, i + 0.5);
    run.RunFor(100ms);
  }
  run.writer.answer = Sent::yes;
  run.RunFor(20ms);
  ASSERT_NE(run.writer.Latest("p1"), nullptr);
  EXPECT_EQ(run.writer.Latest("p1")->value, 50.5);
  EXPECT_EQ(run.writer.Latest("p1")->seq, 50U);
  EXPECT_LE(run.writer.points.size(), 4U);
  EXPECT_EQ(run.sender.counters().failed, 0U);
  EXPECT_THAT(run.lines, SizeIs(0));
}

TEST(SampleSender, RetriesAFullWriterAtMost100TimesASecond) {
  Sending run(MakeConfig(1, 5));
  run.writer.answer = Sent::later;
  const int before = run.writer.asked;
  run.RunFor(10s);
  EXPECT_LE(run.writer.asked - before, 1010);
  EXPECT_GE(run.writer.asked - before, 900);
}

TEST(SampleSender, ANewSessionGetsEverythingAndSeqContinues) {
  Sending run(MakeConfig(2, 3));
  run.RunFor(1ms);
  run.Set(0, 0, 1.5);
  run.Set(0, 0, 2.5);
  run.RunFor(1s);
  run.writer.points.clear();
  run.writer.devices.clear();
  run.sender.StartAnew(run.now.instant);
  run.RunFor(1ms);
  EXPECT_THAT(run.writer.points, SizeIs(6));
  EXPECT_THAT(run.writer.devices, SizeIs(2));
  EXPECT_EQ(run.writer.points.front().seq, 2U);
}

TEST(SampleSender, SendsFinalSamplesOfRemovedDevicesAndContinues) {
  Sending run(MakeConfig(2, 1));
  run.Set(0, 0, 1.5);
  run.Set(1, 0, 2.5);
  run.RunFor(1s);
  run.writer.points.clear();
  config::Line line = run.config.lines[0];
  line.devices[1].points[0].name = "other";
  run.store.Append(std::make_shared<const config::Line>(line));
  run.store.Retire(0);
  run.store.Forget(0);
  run.sender.OnReload(run.now.instant);
  run.RunFor(1s);
  std::vector<std::string> told;
  for (const PointSample& sample : run.writer.points) {
    told.push_back(sample.device + "." + sample.point + " " + std::to_string(sample.quality));
  }
  const std::string was = run.config.lines[0].devices[1].name + "." +
                          run.config.lines[0].devices[1].points[0].name + " ";
  ASSERT_THAT(told, SizeIs(3));
  EXPECT_EQ(told[0], was + std::to_string(Quality(Quality::bad_not_connected).word()));
  EXPECT_EQ(told[1].find(run.config.lines[0].devices[0].name), 0U);
  EXPECT_NE(told[2].find(".other "), std::string::npos);
  run.Set(2, 0, 3.5);
  run.RunFor(100ms);
  EXPECT_THAT(run.writer.points, SizeIs(4));
}

/// The writers store a name for ever, so new writers are opened that have room for the remaining
/// names.
TEST(SampleSender, RemovedPointsReplaceTheWritersAfterTheirFinalSamples) {
  Sending run(MakeConfig(2, 1));
  run.RunFor(1s);
  config::Line line = run.config.lines[0];
  line.devices[0].name = "renamed";
  run.store.Append(std::make_shared<const config::Line>(line));
  run.store.Retire(0);
  run.store.Forget(0);
  run.writer.devices.clear();
  run.sender.OnReload(run.now.instant);
  run.RunFor(0ms);
  ASSERT_THAT(run.writer.devices, SizeIs(::testing::Ge(1U)));
  EXPECT_EQ(run.writer.devices.front().device, "feeder-0");
  EXPECT_EQ(run.writer.devices.front().state, static_cast<int>(bus::DeviceState::disabled));
  ASSERT_THAT(run.writer.reopened, SizeIs(1));
  EXPECT_EQ(run.writer.reopened[0].points, 2U + 512) << "what is gone needs no room";
  run.sender.OnReload(run.now.instant);
  run.RunFor(1s);
  EXPECT_THAT(run.writer.reopened, SizeIs(1)) << "nothing is gone now";
}

TEST(SampleSender, ASecondReloadStillSendsFinalSamples) {
  for (const bool reload_first : {true, false}) {
    Sending run(MakeConfig(2, 1));
    run.RunFor(1s);
    config::Line first = run.config.lines[0];
    first.devices[0].name = "renamed";
    run.store.Append(std::make_shared<const config::Line>(first));
    run.store.Retire(0);
    run.store.Forget(0);
    run.sender.OnReload(run.now.instant);
    run.RunFor(0ms);
    ASSERT_THAT(run.writer.reopened, SizeIs(1));
    run.writer.points.clear();
    config::Line second = first;
    second.devices.resize(1);
    run.store.Append(std::make_shared<const config::Line>(second));
    run.store.Retire(1);
    run.store.Forget(1);
    if (reload_first) run.sender.OnReload(run.now.instant);
    run.sender.StartAnew(run.now.instant);
    if (!reload_first) run.sender.OnReload(run.now.instant);
    run.RunFor(1s);
    const auto is_end = [](const PointSample& sample) {
      return sample.device == "feeder-1" && sample.quality == 0x08;
    };
    EXPECT_EQ(std::ranges::count_if(run.writer.points, is_end), 1) << reload_first;
    EXPECT_THAT(run.writer.reopened, SizeIs(2));
  }
}

TEST(SampleSender, AddedPointsReplaceTheWritersOnlyForRoom) {
  Sending run(MakeConfig(1, 1));
  run.RunFor(1s);
  config::Line few = MakeConfig(1, 10).lines[0];
  few.devices[0].name = "few";
  run.store.Append(std::make_shared<const config::Line>(few));
  run.sender.OnReload(run.now.instant);
  run.RunFor(1s);
  EXPECT_THAT(run.writer.reopened, SizeIs(0));
  config::Line many = MakeConfig(1, 600).lines[0];
  many.devices[0].name = "many";
  run.store.Append(std::make_shared<const config::Line>(many));
  run.writer.answer = Sent::later;
  run.sender.OnReload(run.now.instant);
  run.RunFor(1s);
  run.writer.answer = Sent::yes;
  run.writer.points.clear();
  run.RunFor(1s);
  ASSERT_THAT(run.writer.reopened, SizeIs(1));
  EXPECT_GE(run.writer.reopened[0].points, 611U);
  EXPECT_THAT(run.writer.points, SizeIs(611));
}

/// All points are removed. This causes 1000 final samples, more than can be sent at once.
struct Leaving : Sending {
  explicit Leaving(Sent answer = Sent::later) : Sending(MakeConfig(1, 1000)) {
    RunFor(1s);
    writer.points.clear();
    writer.answer = answer;
    store.Append(std::make_shared<const config::Line>(other));
    store.Retire(0);
    store.Forget(0);
    sender.OnReload(now.instant);
  }
  std::size_t ends() const {
    return static_cast<std::size_t>(std::ranges::count_if(writer.points, [](const auto& sample) {
      return sample.device == "feeder-0" && sample.quality == 0x08;
    }));
  }
  config::Line other = MakeConfig(1, 0).lines[0];
};

TEST(SampleSender, RetriesEachFinalSampleUntilThereIsRoom) {
  for (const Sent answer : {Sent::yes, Sent::later, Sent::refused}) {
    SCOPED_TRACE(static_cast<int>(answer));
    Leaving run(answer);
    run.RunFor(1ms);
    EXPECT_LE(run.ends(), 200U) << "at the pace of all samples";
    run.writer.answer = Sent::yes;
    run.RunFor(2s);
    EXPECT_EQ(run.ends(), 1000U);
  }
}

TEST(SampleSender, SendsNoFinalSampleOfARestoredDevice) {
  Leaving run;
  run.RunFor(1ms);
  run.store.Append(std::make_shared<const config::Line>(run.config.lines[0]));
  run.Set(2, 0, 2.5);
  run.sender.OnReload(run.now.instant);
  run.writer.answer = Sent::yes;
  run.RunFor(2s);
  EXPECT_EQ(run.ends(), 0U);
  EXPECT_EQ(run.writer.Latest("p0")->value, 2.5);
}

TEST(SampleSender, ANewSessionGetsNoFinalSamples) {
  Leaving run;
  run.writer.answer = Sent::yes;
  run.sender.StartAnew(run.now.instant);
  run.RunFor(2s);
  EXPECT_EQ(run.ends(), 0U);
}

TEST(SampleSender, ANewSessionDuringAReloadSendsThePreviousDevices) {
  Sending run(MakeConfig(2, 3));
  run.RunFor(1ms);
  run.writer.points.clear();
  config::Line line = run.config.lines[0];
  line.devices.resize(1);
  line.devices[0].name = "added";
  run.store.Append(std::make_shared<const config::Line>(line));
  run.sender.StartAnew(run.now.instant);
  run.Set(2, 2, 1.5);
  run.RunFor(1ms);
  EXPECT_THAT(run.writer.points, SizeIs(6));
  run.sender.OnReload(run.now.instant);
  run.RunFor(1s);
  EXPECT_EQ(run.writer.points.back().device, "added");
}

}  // namespace
}  // namespace baudgate::dds
