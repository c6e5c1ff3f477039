// Tests of `PointStore` and `ChangeFeed`, with one thread and with two.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/points/point_store.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <memory>
#include <thread>
#include <vector>

#include "tests/support/times.h"
#include "tests/support/virtual_line.h"

namespace baudgate::bus {
namespace {

/// Device 0 has points that are polled every 1 s, every 10 s, once and daily. Device 1 is disabled.
class PointStoreTest : public ::testing::Test {
 protected:
  enum PointIndex : std::uint32_t { kFast, kSlow, kOnce, kDaily };

  PointStoreTest() : config_(MakeConfig()), store_(config_), feed_(store_.Subscribe()) {}

  static config::Config MakeConfig() {
    config::Device device = ToyDevice("d", "A", {"0", "1", "2", "3"});
    device.points[kSlow].group = config::Group::slow;
    device.points[kOnce].group = config::Group::once;
    device.points[kDaily].group = config::Group::daily;
    device.slow = 10s;
    config::Device disabled = device;
    disabled.name = "off";
    disabled.enabled = false;
    config::Config config;
    config.lines.push_back(ToyLine({device, disabled}));
    return config;
  }
  static Now At(Duration time) { return {kStart + time, WallTime(1000s) + time}; }

  void Update(std::uint32_t point, Value value, Duration at, Quality quality = Quality::good) {
    const Sample sample{point, std::move(value), quality};
    store_.Update(0, {&sample, 1}, At(at), 12ms);
  }
  Quality QualityAfter(std::uint32_t point, Duration at, std::uint32_t device = 0) const {
    Quality quality{};
    store_.Read(device, [&](const DeviceRecord& record) {
      quality = QualityAt(record, point, kStart + at);
    });
    return quality;
  }
  PointRecord RecordOf(std::uint32_t point) const {
    PointRecord copy;
    store_.Read(0, [&](const DeviceRecord& record) { copy = record.points[point]; });
    return copy;
  }
  std::vector<std::uint32_t> Told() {
    Changes changes;
    feed_->Drain(Instant(), changes);
    std::vector<std::uint32_t> points;
    for (const PointRef& ref : changes.points) {
      if (ref.device == 0) points.push_back(ref.point);
    }
    return points;
  }
  std::vector<std::uint32_t> AgedAt(Duration at) {
    store_.Age(kStart + at);
    return Told();
  }

  const config::Config config_;
  PointStore store_;
  std::shared_ptr<ChangeFeed> feed_;
};

using Points = std::vector<std::uint32_t>;

TEST_F(PointStoreTest, PointsStartWithTheQualityWaiting) {
  EXPECT_EQ(QualityAfter(kFast, 0s), Quality::bad_waiting);
  EXPECT_EQ(QualityAfter(kFast, 0s, 1), Quality::bad_out_of_service);
  store_.Read(0, [](const DeviceRecord& record) {
    EXPECT_FALSE(AgeAt(record, kFast, kStart));
    EXPECT_FALSE(HasValue(record.points[kFast].value));
  });
}

TEST_F(PointStoreTest, OverridesAndFaultsHideQualitiesByAge) {
  // Qualities from the strongest to the weakest: each hides the qualities that follow.
  Update(kFast, 1.0, 0s, Quality::bad_sensor_failure);
  store_.SetOverride(0, Quality::bad_out_of_service);
  EXPECT_EQ(QualityAfter(kFast, 1h), Quality::bad_out_of_service);
  EXPECT_EQ(QualityAfter(kSlow, 1h), Quality::bad_out_of_service) << "never read";
  store_.SetOverride(0, Quality::bad_not_connected);
  EXPECT_EQ(QualityAfter(kFast, 1h), Quality::bad_not_connected);
  EXPECT_EQ(QualityAfter(kSlow, 1h), Quality::bad_not_connected);
  store_.SetOverride(0, Quality::bad_communication);
  EXPECT_EQ(QualityAfter(kFast, 1h), Quality::bad_communication);
  EXPECT_EQ(QualityAfter(kSlow, 1h), Quality::bad_communication);
  store_.SetOverride(0, std::nullopt);
  EXPECT_EQ(QualityAfter(kSlow, 1h), Quality::bad_waiting);
  EXPECT_EQ(QualityAfter(kFast, 1h), Quality::bad_sensor_failure);
  Update(kFast, 1.0, 0s);
  EXPECT_EQ(QualityAfter(kFast, 1h), Quality::bad_communication) << "dead by age";
  EXPECT_EQ(QualityAfter(kFast, 4s), Quality::uncertain_last_usable);
  EXPECT_EQ(QualityAfter(kFast, 1s), Quality::good);
}

TEST_F(PointStoreTest, AgeLimitsAreInclusive) {
  Update(kFast, 1.0, 0s);
  EXPECT_EQ(QualityAfter(kFast, 3s), Quality::good) << "3 x poll, inclusive";
  EXPECT_EQ(QualityAfter(kFast, 3s + 1ns), Quality::uncertain_last_usable);
  EXPECT_EQ(QualityAfter(kFast, 9s), Quality::uncertain_last_usable);
  EXPECT_EQ(QualityAfter(kFast, 9s + 1ns), Quality::bad_communication);
  Update(kSlow, 1.0, 0s);
  EXPECT_EQ(QualityAfter(kSlow, 30s), Quality::good);
  EXPECT_EQ(QualityAfter(kSlow, 31s), Quality::uncertain_last_usable);
  EXPECT_EQ(QualityAfter(kSlow, 91s), Quality::bad_communication);
}

TEST_F(PointStoreTest, APointReadOnceDoesNotAge) {
  Update(kOnce, 1.0, 0s);
  EXPECT_EQ(QualityAfter(kOnce, 24h * 365), Quality::good);
  store_.SetOverride(0, Quality::bad_communication);
  EXPECT_EQ(QualityAfter(kOnce, 1s), Quality::bad_communication);
}

TEST_F(PointStoreTest, APointReadDailyAgesByItsOwnPeriod) {
  Update(kDaily, 1.0, 0s);
  EXPECT_EQ(QualityAfter(kDaily, 72h), Quality::good);
  EXPECT_EQ(QualityAfter(kDaily, 73h), Quality::uncertain_last_usable);
  EXPECT_EQ(QualityAfter(kDaily, 24h * 9 + 1h), Quality::bad_communication);
}

TEST_F(PointStoreTest, ASlowLineAgesLater) {
  Update(kFast, 1.0, 0s);
  store_.SetLineCycle(0, 10s, kStart);
  EXPECT_EQ(QualityAfter(kFast, 20s), Quality::good) << "twice the measured cycle";
  EXPECT_EQ(QualityAfter(kFast, 21s), Quality::uncertain_last_usable);
  EXPECT_EQ(QualityAfter(kFast, 61s), Quality::bad_communication);
}

TEST_F(PointStoreTest, AnAgedValueStaysAgedWhenTheLineCycleGrows) {
  Update(kFast, 1.0, 0s);
  Update(kSlow, 1.0, 0s);
  store_.SetLineCycle(0, 20s, kStart + 4s);
  EXPECT_EQ(QualityAfter(kFast, 4s), Quality::uncertain_last_usable) << "nobody has read it since";
  EXPECT_EQ(QualityAfter(kFast, 121s), Quality::bad_communication);
  EXPECT_EQ(QualityAfter(kSlow, 40s), Quality::good) << "was not too old";
  store_.SetLineCycle(0, 60s, kStart + 125s);
  EXPECT_EQ(QualityAfter(kFast, 125s), Quality::bad_communication) << "dead stays dead";
  Update(kFast, 2.0, 126s);
  EXPECT_EQ(QualityAfter(kFast, 200s), Quality::good);
}

TEST_F(PointStoreTest, AReportedBadQualityDoesNotLimitTheQualityByAge) {
  Update(kFast, 1.0, 0s, Quality::bad_sensor_failure);
  store_.SetLineCycle(0, 20s, kStart + 1s);
  store_.Read(0, [](const DeviceRecord& record) {
    EXPECT_EQ(record.points[kFast].at_best, Quality::good);
    EXPECT_EQ(record.points[kFast].reported, Quality::bad_sensor_failure);
  });
}

TEST_F(PointStoreTest, NewAgeLimitsApplyToExistingValues) {
  store_.SetLineCycle(0, 10s, kStart);
  Update(kFast, 1.0, 0s);
  ASSERT_EQ(AgedAt(25s), Points{kFast});
  config::Line patient = config_.lines[0];
  patient.devices[0].max_age = 1min;
  store_.Reconfigure(0, std::make_shared<const config::Line>(patient));
  EXPECT_EQ(QualityAfter(kFast, 25s), Quality::good);
  EXPECT_EQ(QualityAfter(kFast, 61s), Quality::uncertain_last_usable) << "counted as before";
  config::Line strict = config_.lines[0];
  strict.devices[0].max_age = 5s;
  store_.Reconfigure(0, std::make_shared<const config::Line>(strict));
  EXPECT_EQ(QualityAfter(kFast, 19s), Quality::good) << "two rounds of the line, as before";
  EXPECT_EQ(QualityAfter(kFast, 21s), Quality::uncertain_last_usable);
  Told();
  EXPECT_EQ(AgedAt(61s), Points{kFast}) << "and the feed hears of it";
}

TEST_F(PointStoreTest, TheLastGoodValueRemainsUnderABadQuality) {
  Update(kFast, 1.5, 0s);
  Update(kFast, {}, 1s, Quality::bad_sensor_failure);
  EXPECT_EQ(RecordOf(kFast).value, Value(1.5));
  EXPECT_EQ(QualityAfter(kFast, 1s), Quality::bad_sensor_failure);
  Update(kFast, 999.0, 2s, Quality::bad_device_failure);
  EXPECT_EQ(RecordOf(kFast).value, Value(1.5)) << "on_bad: hold would serve it as a measurement";
  Update(kFast, 2.5, 3s, Quality::uncertain_sub_normal);
  EXPECT_EQ(RecordOf(kFast).value, Value(2.5));
}

TEST_F(PointStoreTest, ADoubtedPointRetainsItsValueAndItsAge) {
  Update(kFast, 5.0, 0s);
  const PointRecord before = RecordOf(kFast);
  Told();
  store_.Doubt(0, std::vector<std::size_t>{kFast}, kStart + 1s);
  EXPECT_EQ(Told(), Points{kFast});
  const PointRecord after = RecordOf(kFast);
  EXPECT_EQ(QualityAfter(kFast, 1s), Quality::uncertain);
  EXPECT_EQ(after.reported, Quality::good) << "the device's own word";
  EXPECT_EQ(after.value, before.value);
  EXPECT_EQ(after.read_at, before.read_at);
  EXPECT_EQ(after.seq, before.seq);
  Update(kFast, {}, 2s, Quality::bad_sensor_failure);
  store_.Doubt(0, std::vector<std::size_t>{kFast}, kStart + 3s);
  EXPECT_EQ(RecordOf(kFast).reported, Quality::bad_sensor_failure) << "what is bad stays so";
}

TEST_F(PointStoreTest, UpdatesCarryBothTimesAndASequence) {
  Update(kFast, 1.0, 5s);
  Update(kFast, 1.0, 6s);
  const PointRecord record = RecordOf(kFast);
  EXPECT_EQ(record.seq, 2U);
  EXPECT_EQ(record.read_at, kStart + 6s);
  EXPECT_EQ(record.source_time, WallTime(1006s));
  EXPECT_EQ(record.rtt_us, 12'000U);
}

TEST_F(PointStoreTest, AgeingReportsEachChangeExactlyOnce) {
  Update(kFast, 1.0, 0s);
  Update(kOnce, 1.0, 0s);
  EXPECT_EQ(Told(), (Points{kFast, kOnce}));
  int told = 0;
  for (Duration at = 0s; at < 60s; at += 100ms) {
    const Points aged = AgedAt(at);
    told += static_cast<int>(aged.size());
    if (at == 3s || at == 9s) {
      EXPECT_TRUE(aged.empty());
    }
    if (at == 3100ms || at == 9100ms) {
      EXPECT_EQ(aged, Points{kFast});
    }
  }
  EXPECT_EQ(told, 2) << "good to uncertain, uncertain to bad";
}

TEST_F(PointStoreTest, AFreshReadingAfterAgeingIsReportedAndAgesAgain) {
  Update(kFast, 1.0, 0s);
  AgedAt(20s);
  Update(kFast, 1.0, 20s);
  EXPECT_EQ(Told(), Points{kFast});
  EXPECT_TRUE(AgedAt(22s).empty());
  EXPECT_EQ(AgedAt(24s), Points{kFast});
}

TEST_F(PointStoreTest, AgeingIsFoundAfterTheCycleBecameShorter) {
  store_.SetLineCycle(0, 100s, kStart);
  Update(kFast, 1.0, 0s);
  Told();
  EXPECT_TRUE(AgedAt(10s).empty());
  store_.SetLineCycle(0, 1s, kStart + 10s);
  EXPECT_EQ(AgedAt(10s), Points{kFast});
}

TEST_F(PointStoreTest, AnOverrideIsReportedOnce) {
  Update(kFast, 1.0, 0s);
  Told();
  store_.SetOverride(0, Quality::bad_communication);
  EXPECT_EQ(Told().size(), 4U) << "at once, without waiting for Age";
  EXPECT_TRUE(AgedAt(1s).empty());
  store_.SetOverride(0, Quality::bad_communication);
  EXPECT_TRUE(Told().empty());
  store_.SetOverride(0, std::nullopt);
  EXPECT_EQ(Told().size(), 4U);
}

TEST_F(PointStoreTest, OldValuesOfAReturningDeviceAreReportedAsOld) {
  Update(kFast, 1.0, 0s);
  store_.SetOverride(0, Quality::bad_communication);
  EXPECT_EQ(AgedAt(1s).size(), 4U);
  store_.SetOverride(0, std::nullopt);
  Told();
  AgedAt(2s);
  EXPECT_EQ(AgedAt(5s), Points{kFast}) << "ageing goes on behind an override";
}

TEST_F(PointStoreTest, StatusChangesReachTheFeed) {
  store_.UpdateStatus(1, [](DeviceStatus& status) { ++status.exchanges; });
  Changes changes;
  feed_->Drain(Instant(), changes);
  EXPECT_EQ(changes.devices, Points{1});
  store_.Read(1, [](const DeviceRecord& record) { EXPECT_EQ(record.status.exchanges, 1U); });
}

TEST_F(PointStoreTest, NoReaderSeesHalfAnUpdate) {
  std::atomic<bool> stop = false;
  std::thread writer([&] {
    for (int i = 1; i <= 20'000; ++i) {
      const Sample samples[] = {{kFast, double(i), Quality::good},
                                {kSlow, double(i), Quality::good}};
      store_.Update(0, samples, At(i * 1ms), 1ms);
      store_.SetOverride(0, i % 100 == 0 ? Override(Quality::bad_communication) : Override());
      store_.UpdateStatus(0, [](DeviceStatus& status) { ++status.exchanges; });
      store_.SetLineCycle(0, i * 1us, kStart + i * 1ms);
    }
    stop = true;
  });
  std::thread ageing([&] {
    for (int i = 0; !stop; ++i) store_.Age(kStart + i * 1ms);
  });
  Changes changes;
  while (!stop) {
    store_.Read(0, [](const DeviceRecord& record) {
      EXPECT_EQ(record.points[kFast].value, record.points[kSlow].value);
      EXPECT_EQ(record.points[kFast].seq, record.points[kSlow].seq);
      EXPECT_EQ(record.points[kFast].read_at, record.points[kSlow].read_at);
    });
    feed_->Drain(Instant(), changes);
    EXPECT_LE(changes.points.size(), 8U);
  }
  writer.join();
  ageing.join();
  EXPECT_EQ(RecordOf(kFast).seq, 20'000U);
}

class ChangeFeedTest : public ::testing::Test {
 protected:
  void Mark(std::uint32_t device, std::vector<std::uint32_t> points) {
    feed_.MarkPoints(device, points);
  }
  Changes Drain() {
    Changes changes;
    feed_.Drain(Instant(), changes);
    return changes;
  }

  static constexpr std::array<std::size_t, 2> kCounts = {3, 1};
  ChangeFeed feed_{kCounts};
};

TEST_F(ChangeFeedTest, DrainIsEmptyWithoutChanges) { EXPECT_TRUE(Drain().empty()); }

TEST_F(ChangeFeedTest, RepeatedChangesCoalesce) {
  for (int i = 0; i < 100'000; ++i) {
    Mark(0, {0, 2});
    Mark(1, {0});
    feed_.MarkDevice(1);
  }
  const Changes changes = Drain();
  EXPECT_EQ(changes.points.size(), 3U) << "never more than there are points";
  EXPECT_EQ(changes.devices, std::vector<std::uint32_t>{1});
  EXPECT_TRUE(Drain().empty());
}

TEST_F(ChangeFeedTest, AChangeAfterTheDrainIsNewAgain) {
  Mark(0, {1});
  Drain();
  Mark(0, {1});
  feed_.MarkDevice(0);
  const Changes changes = Drain();
  ASSERT_EQ(changes.points.size(), 1U);
  EXPECT_EQ(changes.points[0].device, 0U);
  EXPECT_EQ(changes.points[0].point, 1U);
  EXPECT_EQ(changes.devices.size(), 1U);
}

TEST_F(ChangeFeedTest, DrainClearsTheOldChangesOfTheCaller) {
  Changes changes;
  changes.points.resize(7);
  changes.devices.resize(7);
  feed_.Drain(Instant(), changes);
  EXPECT_TRUE(changes.empty());
  Mark(0, {0});
  EXPECT_EQ(Drain().points.size(), 1U) << "an old result came back as pending";
}

TEST_F(ChangeFeedTest, WakeEndsAWaitEvenBeforeItBegins) {
  feed_.Wake();
  Changes changes;
  feed_.Drain(Instant::max(), changes);
  EXPECT_TRUE(changes.empty());
}

TEST_F(ChangeFeedTest, AWaitingDrainReturnsAtAChange) {
  std::thread producer([this] { Mark(0, {1}); });
  Changes changes;
  feed_.Drain(Instant::max(), changes);
  producer.join();
  EXPECT_EQ(changes.points.size(), 1U);
}

TEST_F(ChangeFeedTest, NoChangeIsLostBetweenThreads) {
  std::thread producer([this] {
    for (std::uint32_t i = 0; i < 20'000; ++i) Mark(0, {i % 3});
    Mark(1, {0});
  });
  bool last_seen = false;
  while (!last_seen) {
    Changes changes;
    feed_.Drain(Instant::max(), changes);
    EXPECT_LE(changes.points.size(), 4U);
    for (const PointRef& ref : changes.points) last_seen = last_seen || ref.device == 1;
  }
  producer.join();
}

config::Line LineOf(const std::string& device, std::size_t points = 1) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < points; ++i) names.push_back(std::to_string(i));
  config::Line line = ToyLine({ToyDevice(device, "A", names)});
  line.name = "of " + device;
  return line;
}

class GrowingStore : public ::testing::Test {
 protected:
  GrowingStore() { config_.lines = {LineOf("a"), LineOf("b", 2)}; }

  void Update(std::uint32_t device, double value) {
    const Sample sample{0, value, Quality::good};
    store().Update(device, {&sample, 1}, {Instant(1h), WallTime(1h)}, 1ms);
  }
  PointRecord RecordOf(std::uint32_t device) {
    PointRecord copy;
    store().Read(device, [&](const DeviceRecord& record) { copy = record.points[0]; });
    return copy;
  }
  PointStore& store() {
    if (!store_) store_ = std::make_unique<PointStore>(config_);
    return *store_;
  }

  config::Config config_;
  std::unique_ptr<PointStore> store_;
};

TEST_F(GrowingStore, AnAddedLineGetsTheNextNumbersAndReachesTheFeeds) {
  const auto feed = store().Subscribe();
  Update(1, 5);
  const config::Line more = LineOf("c", 3);
  store().Append(std::make_shared<const config::Line>(more));
  EXPECT_EQ(store().device_count(), 3U);
  EXPECT_EQ(store().LineIndex(more), 2U);
  EXPECT_EQ(store().device(2)->name, "c");
  Update(2, 7);
  Changes changes;
  feed->Drain(Instant(), changes);
  ASSERT_EQ(changes.points.size(), 2U);
  EXPECT_EQ(changes.points[1].device, 2U);
  EXPECT_EQ(std::get<double>(RecordOf(1).value), 5);
  const auto later = store().Subscribe();
  Update(2, 8);
  later->Drain(Instant(), changes);
  EXPECT_EQ(changes.points.size(), 1U);
  store().Unsubscribe(later);
  Update(2, 9);
  later->Drain(Instant(), changes);
  EXPECT_TRUE(changes.empty());
}

TEST_F(GrowingStore, AFeedSubscribedDuringGrowthReportsEachChangedDevice) {
  std::atomic<bool> done = false;
  std::atomic<std::uint32_t> drained = 0;
  store();
  std::thread subscriber([&] {
    Changes changes;
    while (!done) {
      const auto feed = store().Subscribe();
      Update(0, 1);
      feed->Drain(Instant(), changes);
      drained += static_cast<std::uint32_t>(changes.points.size());
      store().Unsubscribe(feed);
    }
  });
  const config::Line more = LineOf("c");
  for (std::uint32_t device = 2; device < 2000; ++device) {
    store().Append(std::make_shared<const config::Line>(more));
    store().UpdateStatus(device, [](DeviceStatus& status) { status.state = DeviceState::online; });
  }
  done = true;
  subscriber.join();
  EXPECT_GT(drained, 0U);
  const auto feed = store().Subscribe();
  Update(1999, 1);
  Changes changes;
  feed->Drain(Instant(), changes);
  ASSERT_EQ(changes.points.size(), 1U);
  EXPECT_EQ(changes.points[0].device, 1999U);
}

TEST_F(GrowingStore, ARetiredLineLeavesAllNumbersUnchanged) {
  Update(0, 5);
  store().Retire(0);
  EXPECT_TRUE(store().gone(0));
  EXPECT_FALSE(store().gone(1));
  EXPECT_EQ(store().device_count(), 2U);
  EXPECT_EQ(store().present_count(), 1U);
  EXPECT_EQ(store().LineIndex(config_.lines[1]), 1U);
  EXPECT_NE(store().LineIndex(config_.lines[0]), 0U) << "its place in memory may be another's";
  EXPECT_EQ(RecordOf(0).seq, 1U);
}

TEST_F(GrowingStore, AForgottenLineIsFreedWhenItsLastHolderReleasesIt) {
  Update(0, 5);
  const std::weak_ptr<const config::Line> line = store().LineAt(0);
  store().Retire(0);
  EXPECT_EQ(store().LineAt(0), nullptr);
  EXPECT_EQ(store().device(0)->name, "a") << "outputs have it until they are told";
  auto held = store().Hold(0);
  store().Forget(0);
  EXPECT_EQ(std::get<double>(RecordOf(0).value), 5) << "it is held";
  EXPECT_FALSE(line.expired());
  held.reset();
  EXPECT_TRUE(line.expired());
  EXPECT_EQ(store().Hold(0), nullptr);
  EXPECT_EQ(store().device(0), nullptr);
  EXPECT_FALSE(store().Read(0, [](const DeviceRecord&) { ADD_FAILURE(); }));
  EXPECT_EQ(store().point_count(0), 1U) << "numbers of points stay";
  EXPECT_EQ(store().device(1)->name, "b");
}

TEST_F(GrowingStore, UpdatesOfAForgottenDeviceAreIgnored) {
  store().Retire(0);
  store().Forget(0);
  Update(0, 5);
  const std::size_t point = 0;
  store().Doubt(0, {&point, 1}, Instant(1h));
  store().SetOverride(0, Quality::bad_communication);
  store().SetLineCycle(0, 1s, Instant(1h));
  store().UpdateStatus(0, [](DeviceStatus&) { ADD_FAILURE(); });
  store().UpdateLine(0, [](LineStatus&) { ADD_FAILURE(); });
  store().Age(Instant(2h));
  EXPECT_EQ(store().ReadLine(0).port_text, LineStatus().port_text);
  EXPECT_EQ(store().line(0), nullptr);
}

TEST_F(GrowingStore, AReplacedConfigurationStaysValidForItsReaders) {
  const config::Line& begun = *store().LineAt(1);
  store().Reconfigure(1, std::make_shared<const config::Line>(begun));
  const std::weak_ptr<const config::Line> before = store().line(1);
  const auto device = store().device(1);
  store().Reconfigure(1, std::make_shared<const config::Line>(begun));
  EXPECT_FALSE(before.expired()) << "a reader has it";
  EXPECT_EQ(device->name, "b");
}

TEST_F(GrowingStore, ANewConfigurationKeepsValueAndCount) {
  const auto feed = store().Subscribe();
  Update(0, 5);
  Changes changes;
  feed->Drain(Instant(), changes);
  config::Line as = config_.lines[0];
  as.devices[0].unit = 9;
  store().Reconfigure(0, std::make_shared<const config::Line>(as));
  EXPECT_EQ(store().device(0)->unit, 9);
  EXPECT_EQ(std::get<double>(RecordOf(0).value), 5);
  EXPECT_EQ(RecordOf(0).seq, 1U);
  feed->Drain(Instant(), changes);
  EXPECT_EQ(changes.points.size(), 1U) << "outputs look again";
  EXPECT_EQ(store().LineIndex(config_.lines[0]), 0U) << "the line itself knows it as it was";
}

TEST(PointStoreLocks, TheConfigurationOfADeviceCanBeAskedForWhileItsRecordIsRead) {
  config::Config config;
  config.lines.resize(1);
  config.lines[0].devices.resize(1);
  const PointStore store(config);
  store.Read(0, [&store](const DeviceRecord& record) {
    EXPECT_EQ(store.device(0), record.device);
    EXPECT_EQ(store.line(0), record.line);
  });
}

}  // namespace
}  // namespace baudgate::bus
