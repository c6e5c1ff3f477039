// A store that gets and loses lines while others use it: numbers stay, and so does what is known.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <thread>

#include "gateway/bus/points/point_store.h"
#include "tests/support/virtual_line.h"

namespace baudgate {
namespace {

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

TEST_F(GrowingStore, ALineThatComesGetsTheNextNumbersAndIsToldOf) {
  const auto feed = store().Subscribe();
  Update(1, 5);
  const config::Line more = LineOf("c", 3);
  store().Append(more);
  EXPECT_EQ(store().device_count(), 3U);
  EXPECT_EQ(store().LineIndex(more), 2U);
  EXPECT_EQ(store().device(2).name, "c");
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

TEST_F(GrowingStore, AFeedThatBeginsMeanwhileKnowsEachDeviceThatChanges) {
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
    store().Append(more);
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

TEST_F(GrowingStore, ALineThatGoesLeavesItsNumbers) {
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

TEST_F(GrowingStore, ANewConfigurationKeepsValueAndCount) {
  const auto feed = store().Subscribe();
  Update(0, 5);
  Changes changes;
  feed->Drain(Instant(), changes);
  config::Line as = config_.lines[0];
  as.devices[0].unit = 9;
  store().Reconfigure(0, as);
  EXPECT_EQ(store().device(0).unit, 9);
  EXPECT_EQ(std::get<double>(RecordOf(0).value), 5);
  EXPECT_EQ(RecordOf(0).seq, 1U);
  feed->Drain(Instant(), changes);
  EXPECT_EQ(changes.points.size(), 1U) << "outputs look again";
  EXPECT_EQ(store().LineIndex(config_.lines[0]), 0U) << "the line itself knows it as it was";
}

}  // namespace
}  // namespace baudgate
