// The publisher on a writer that only remembers: what of the store becomes which sample.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/dds/publisher.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/gateway/dds/fixture.h"

namespace baudgate::dds {
namespace {

using testing::MakeConfig;
using testing::Set;

/// What has been written, shared with the test that waits for it.
struct Written {
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<PointSample> points;
  std::vector<DeviceSample> devices;
  std::vector<std::string> disposed;
  bool refuse = false;
  std::size_t refused = 0;

  template <typename Condition>
  bool WaitFor(Condition condition) {
    std::unique_lock lock(mutex);
    return changed.wait_for(lock, 20s, condition);
  }
  /// The latest sample of a point; call inside WaitFor.
  const PointSample* Latest(const std::string& point) const {
    const auto at = std::find_if(points.rbegin(), points.rend(),
                                 [&](const PointSample& s) { return s.point == point; });
    return at == points.rend() ? nullptr : &*at;
  }
};

class RememberingWriter : public SampleWriter {
 public:
  explicit RememberingWriter(Written& written) : written_(written) {}
  bool Write(const PointSample& sample) override { return Keep(written_.points, sample); }
  bool Write(const DeviceSample& sample) override { return Keep(written_.devices, sample); }
  bool Dispose(const PointSample& sample) override {
    return Keep(written_.disposed, sample.device + "." + sample.point);
  }
  bool Dispose(const DeviceSample& sample) override {
    return Keep(written_.disposed, sample.device);
  }
  bool WaitAcknowledged(Duration) override { return true; }
  std::uint32_t subscribers() const override { return 0; }

 private:
  template <typename T>
  bool Keep(std::vector<T>& list, const T& entry) {
    const std::lock_guard lock(written_.mutex);
    written_.changed.notify_all();
    if (written_.refuse) {
      ++written_.refused;
      return false;
    }
    list.push_back(entry);
    return true;
  }
  Written& written_;
};

struct Running {
  explicit Running(config::Config made, DdsPublisher::Log log = {})
      : config(std::move(made)), store(config) {
    publisher = std::move(*DdsPublisher::Create(config, store, std::move(log),
                                                std::make_unique<RememberingWriter>(written)));
  }
  Written written;
  const config::Config config;
  PointStore store;
  std::unique_ptr<DdsPublisher> publisher;
};

TEST(Publisher, StartsWithAnImageThatWaitsForData) {
  Running run(MakeConfig(2, 3));
  ASSERT_TRUE(run.written.WaitFor(
      [&] { return run.written.points.size() >= 6 && run.written.devices.size() >= 2; }));
  const PointSample& sample = *run.written.Latest("p2");
  EXPECT_EQ(sample.gateway, "substation-7");
  EXPECT_EQ(sample.quality, 0x20);
  EXPECT_TRUE(std::isnan(sample.value));
  EXPECT_EQ(sample.text, "");
  EXPECT_EQ(sample.unit, "A");
  EXPECT_EQ(sample.source_time_ns, 0);
  EXPECT_EQ(sample.seq, 0U);
  EXPECT_EQ(run.written.devices.front().line, "bay");
  EXPECT_EQ(run.written.devices.front().last_ok_time_ns, 0);
}

TEST(Publisher, SendsAReadingWithItsTimeAndRoundTrip) {
  Running run(MakeConfig(1, 2));
  Set(run.store, 0, 1, 2.5, Quality::uncertain_sub_normal);
  ASSERT_TRUE(run.written.WaitFor([&] {
    const PointSample* latest = run.written.Latest("p1");
    return latest != nullptr && latest->seq == 1;
  }));
  const PointSample& sample = *run.written.Latest("p1");
  EXPECT_EQ(sample.value, 2.5);
  EXPECT_EQ(sample.quality, 0x58);
  EXPECT_EQ(sample.rtt_us, 5000U);
  EXPECT_GT(sample.source_time_ns, 1'600'000'000'000'000'000);
}

TEST(Publisher, SendsTextVisiblyBounded) {
  Running run(MakeConfig(1, 1));
  Set(run.store, 0, 0, std::string(200, 'x'));
  ASSERT_TRUE(run.written.WaitFor([&] {
    const PointSample* latest = run.written.Latest("p0");
    return latest != nullptr && latest->seq == 1;
  }));
  const PointSample& sample = *run.written.Latest("p0");
  EXPECT_TRUE(std::isnan(sample.value));
  EXPECT_EQ(sample.text.size(), kMaxText);
  EXPECT_THAT(sample.text, ::testing::EndsWith("x\u2026"));
}

TEST(Publisher, AChangeOfQualityPassesTheDeadband) {
  config::Config config = MakeConfig(1, 1);
  config.lines[0].devices[0].points[0].deadband = 1000;
  Running run(std::move(config));
  Set(run.store, 0, 0, 2.5);
  ASSERT_TRUE(run.written.WaitFor([&] {
    const PointSample* latest = run.written.Latest("p0");
    return latest != nullptr && latest->quality == 0xC0;
  }));
  run.store.SetOverride(0, Override::not_connected);
  ASSERT_TRUE(run.written.WaitFor([&] { return run.written.Latest("p0")->quality == 0x08; }));
  EXPECT_EQ(run.written.Latest("p0")->value, 2.5);
}

TEST(Publisher, AgeingIsSentWithoutAnyReading) {
  config::Config config = MakeConfig(1, 1);
  config.lines[0].devices[0].max_age = 10ms;
  config.lines[0].devices[0].dead_age = 20ms;
  Running run(std::move(config));
  Set(run.store, 0, 0, 2.5);
  EXPECT_TRUE(run.written.WaitFor([&] {
    const PointSample* latest = run.written.Latest("p0");
    return latest != nullptr && latest->seq == 1 && latest->quality == 0x18;
  }));
}

TEST(Publisher, DeviceStatusCarriesCountersAndState) {
  Running run(MakeConfig(1, 1));
  run.store.UpdateStatus(0, [](DeviceStatus& status) {
    status.state = DeviceState::online;
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
  ASSERT_TRUE(run.written.WaitFor(
      [&] { return !run.written.devices.empty() && run.written.devices.back().state == 1; }));
  const DeviceSample& sample = run.written.devices.back();
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

TEST(Publisher, RepeatsWhatWasRefusedAndSaysSoOnce) {
  std::mutex mutex;
  std::vector<std::string> lines;
  Running run(MakeConfig(1, 20), [&](const std::string& line) {
    const std::lock_guard lock(mutex);
    lines.push_back(line);
  });
  ASSERT_TRUE(run.written.WaitFor(
      [&] { return run.written.points.size() >= 20 && !run.written.devices.empty(); }));
  run.written.WaitFor([&] { return run.written.refuse = true; });
  for (std::uint32_t point = 0; point < 20; ++point) Set(run.store, 0, point, 1.0);
  ASSERT_TRUE(run.written.WaitFor([&] { return run.written.refused >= 20; }));
  run.written.WaitFor([&] {
    run.written.refuse = false;
    return true;
  });
  ASSERT_TRUE(run.written.WaitFor([&] {
    for (int point = 0; point < 20; ++point) {
      if (run.written.Latest("p" + std::to_string(point))->value != 1.0) return false;
    }
    return true;
  }));
  EXPECT_GE(run.publisher->counters().failed, 20U);
  run.publisher->Stop();
  const std::lock_guard lock(mutex);
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_THAT(lines[0], ::testing::HasSubstr("refused"));
  EXPECT_THAT(lines[1], ::testing::HasSubstr("again"));
}

TEST(Publisher, DisposesEverythingAtStop) {
  Running run(MakeConfig(2, 2));
  ASSERT_TRUE(run.written.WaitFor(
      [&] { return run.written.points.size() >= 4 && run.written.devices.size() >= 2; }));
  run.publisher->Stop();
  run.publisher->Stop();
  EXPECT_THAT(run.written.disposed,
              ::testing::UnorderedElementsAre("feeder-0.p0", "feeder-0.p1", "feeder-1.p0",
                                              "feeder-1.p1", "feeder-0", "feeder-1"));
}

TEST(Publisher, RefusesNamesThatAreNoKeys) {
  config::Config config = MakeConfig(1, 1);
  config.lines[0].devices[0].points[0].name = std::string(65, 'p');
  PointStore store(config);
  const auto publisher = DdsPublisher::Create(config, store);
  ASSERT_FALSE(publisher.ok());
  EXPECT_THAT(publisher.error(), ::testing::HasSubstr("longer than 64"));
}

TEST(Publisher, RefusesAnAddressThatIsNotOurs) {
  config::Config config = MakeConfig(1, 1);
  config.dds.interfaces = {"192.0.2.1"};
  PointStore store(config);
  const auto publisher = DdsPublisher::Create(config, store);
  ASSERT_FALSE(publisher.ok());
  EXPECT_THAT(publisher.error(), ::testing::HasSubstr("192.0.2.1"));
}

}  // namespace
}  // namespace baudgate::dds
