// Tests of `DdsPublisher`. tests/gateway/outputs/dds/sample_sender_test.cpp tests the content of
// its samples.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/publisher.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <future>
#include <limits>
#include <map>
#include <mutex>
#include <random>

#include "gateway/outputs/dds/publish_plan.h"
#include "gateway/outputs/dds/sample_writer.h"
#include "tests/gateway/outputs/dds/fixture.h"
#include "tests/gateway/outputs/dds/remembering_writer.h"
#include "tests/support/times.h"

namespace baudgate::dds {
namespace {

using testing::MakeConfig;
using testing::RememberingWriter;

class TellingWriter : public RememberingWriter {
 public:
  Sent Write(const PointSample& sample) override {
    if (sample.value == 2.5) told.set_value();
    return RememberingWriter::Write(sample);
  }
  using RememberingWriter::Write;

  std::promise<void> told;
};

TEST(Publisher, SendsOnItsThreadUntilItIsStopped) {
  const config::Config config = MakeConfig(2, 2);
  bus::PointStore store(config);
  const auto writer = std::make_shared<TellingWriter>();
  auto publisher = std::move(*DdsPublisher::Create(config, store, writer));
  testing::Set(store, 1, 1, 2.5);
  writer->told.get_future().wait();
  publisher->Stop();
  publisher->Stop();
  EXPECT_GE(publisher->counters().written, 1U);
}

TEST(Publisher, RefusesNamesThatAreTooLongForKeys) {
  config::Config config = MakeConfig(1, 1);
  config.lines[0].devices[0].points[0].name = std::string(65, 'p');
  bus::PointStore store(config);
  const auto publisher = DdsPublisher::Create(config, store, std::make_unique<RememberingWriter>());
  ASSERT_FALSE(publisher.ok());
  EXPECT_THAT(publisher.error(), ::testing::HasSubstr("longer than 64"));
}

class ChangingWriter : public RememberingWriter {
 public:
  Sent Write(const PointSample& sample) override {
    const std::lock_guard lock(mutex_);
    got_.emplace_back(session_, sample.value);
    changed_.notify_all();
    return Sent::yes;
  }
  using RememberingWriter::Write;
  std::uint64_t session() const override {
    const std::lock_guard lock(mutex_);
    return session_;
  }
  void OnSession(const std::function<void()>& changed) override { changed_session_ = changed; }

  void SetSession(std::uint64_t session) {
    {
      const std::lock_guard lock(mutex_);
      session_ = session;
    }
    changed_session_();
  }
  void WaitFor(std::pair<std::uint64_t, double> wanted) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return std::find(got_.begin(), got_.end(), wanted) != got_.end(); });
  }
  std::vector<std::pair<std::uint64_t, double>> got() {
    const std::lock_guard lock(mutex_);
    return got_;
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::uint64_t session_ = 0;
  std::vector<std::pair<std::uint64_t, double>> got_;
  std::function<void()> changed_session_;
};

TEST(Publisher, SendsEverythingToANewSessionAndNothingWithoutOne) {
  const config::Config config = MakeConfig(1, 1);
  bus::PointStore store(config);
  auto writer = std::make_shared<ChangingWriter>();
  auto publisher = std::move(*DdsPublisher::Create(config, store, writer));
  testing::Set(store, 0, 0, 1.5);
  writer->SetSession(3);
  writer->WaitFor({3, 1.5});
  writer->SetSession(0);
  testing::Set(store, 0, 0, 2.5);
  writer->SetSession(4);
  writer->WaitFor({4, 2.5});
  publisher->Stop();
  for (const auto& [session, value] : writer->got()) EXPECT_NE(session, 0U) << value;
}

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

PointState Number(double value, Quality quality = Quality::good) {
  return PointState::Of(value, quality);
}

PublishPlan SentSample(double value, double deadband = 0) {
  PublishPlan plan({}, {deadband}, 0, kStart);
  plan.PointSent(0, Number(value), kStart);
  return plan;
}

TEST(PublishPlan, WantsEveryPointAtFirst) {
  PublishPlan plan({}, {0, 5}, 1, kStart);
  EXPECT_TRUE(plan.WantsPoint(0, Number(0, Quality::bad_waiting)));
  EXPECT_TRUE(plan.WantsPoint(1, PointState::Of(Value(), Quality::bad_waiting)));
  EXPECT_FALSE(plan.WasSent(0));
  plan.PointSent(0, Number(0), kStart);
  EXPECT_TRUE(plan.WasSent(0));
}

TEST(PublishPlan, DoesNotRepeatAnUnchangedPoint) {
  EXPECT_FALSE(SentSample(1.5).WantsPoint(0, Number(1.5)));
  EXPECT_TRUE(SentSample(1.5).WantsPoint(0, Number(std::nextafter(1.5, 2))));
}

TEST(PublishPlan, KeepsSmallChangesBack) {
  const PublishPlan plan = SentSample(10, 0.5);
  EXPECT_FALSE(plan.WantsPoint(0, Number(10.5)));
  EXPECT_FALSE(plan.WantsPoint(0, Number(9.5)));
  EXPECT_TRUE(plan.WantsPoint(0, Number(10.51)));
  EXPECT_TRUE(plan.WantsPoint(0, Number(9.49)));
}

TEST(PublishPlan, MeasuresTheDeadbandFromTheLastSentValue) {
  PublishPlan plan = SentSample(10, 0.5);
  EXPECT_FALSE(plan.WantsPoint(0, Number(10.3)));
  EXPECT_TRUE(plan.WantsPoint(0, Number(10.6)));
}

TEST(PublishPlan, SendsAChangeOfQualityWhateverTheDeadband) {
  const PublishPlan plan = SentSample(10, 1000);
  EXPECT_TRUE(plan.WantsPoint(0, Number(10, Quality::uncertain_last_usable)));
  EXPECT_TRUE(plan.WantsPoint(0, Number(10, Quality::bad_communication)));
}

TEST(PublishPlan, ComparesNaNAndInfinity) {
  EXPECT_FALSE(SentSample(kNan).WantsPoint(0, Number(kNan)));
  EXPECT_TRUE(SentSample(kNan, 5).WantsPoint(0, Number(0)));
  EXPECT_TRUE(SentSample(0, 5).WantsPoint(0, Number(kNan)));
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(SentSample(kInfinite, 5).WantsPoint(0, Number(kInfinite)));
  EXPECT_TRUE(SentSample(kInfinite, 5).WantsPoint(0, Number(-kInfinite)));
  EXPECT_TRUE(SentSample(kInfinite, 5).WantsPoint(0, Number(1)));
}

TEST(PublishPlan, SeesChangedText) {
  PublishPlan plan({}, {100}, 0, kStart);
  plan.PointSent(0, PointState::Of(std::string("SPCJ 4D29"), Quality::good), kStart);
  EXPECT_FALSE(plan.WantsPoint(0, PointState::Of(std::string("SPCJ 4D29"), Quality::good)));
  EXPECT_TRUE(plan.WantsPoint(0, PointState::Of(std::string("SPCJ 4D28"), Quality::good)));
}

TEST(PublishPlan, TheFirstImageIsSentInPortions) {
  PublishPlan plan({}, std::vector<double>(100, 0), 0, kStart);
  std::vector<std::uint32_t> due;
  std::vector<bool> seen(100, false);
  for (std::size_t left = 100; left > 0;) {
    plan.TakeDuePoints(kStart, 30, due);
    ASSERT_EQ(due.size(), std::min<std::size_t>(30, left));
    left -= due.size();
    for (const auto slot : due) {
      ASSERT_FALSE(seen[slot]);
      seen[slot] = true;
      plan.PointSent(slot, Number(0), kStart);
    }
  }
  plan.TakeDuePoints(kStart, 30, due);
  EXPECT_TRUE(due.empty());
}

TEST(PublishPlan, SendsAnUnchangedPointWithinTheHeartbeat) {
  PublishPlan plan({.heartbeat = 10s}, std::vector<double>(1000, 0), 0, kStart);
  std::map<std::uint32_t, Instant> last;
  for (std::uint32_t slot = 0; slot < 1000; ++slot) {
    plan.PointSent(slot, Number(1), kStart);
    last[slot] = kStart;
  }
  std::vector<std::uint32_t> due;
  std::size_t most_at_once = 0;
  for (Instant now = kStart; now < kStart + 60s; now += 10ms) {
    plan.TakeDuePoints(now, 1000, due);
    most_at_once = std::max(most_at_once, due.size());
    for (const auto slot : due) {
      ASSERT_TRUE(plan.WantsPoint(slot, Number(1)));
      ASSERT_LE(now - last[slot], 10s + 10ms);
      ASSERT_GE(now - last[slot], 7s);
      plan.PointSent(slot, Number(1), now);
      last[slot] = now;
    }
  }
  for (const auto& [slot, at] : last) EXPECT_GE(at, kStart + 49s) << slot;
  EXPECT_LE(most_at_once, 12U);
}

TEST(PublishPlan, AChangePutsTheHeartbeatOff) {
  PublishPlan plan = SentSample(1);
  std::vector<std::uint32_t> due;
  for (int second = 1; second <= 30; ++second) {
    plan.PointSent(0, Number(second), kStart + std::chrono::seconds(second));
    plan.TakeDuePoints(kStart + std::chrono::seconds(second), 10, due);
    EXPECT_TRUE(due.empty()) << second;
  }
}

TEST(PublishPlan, TriesAgainAfterAFailedWrite) {
  PublishPlan plan = SentSample(1);
  ASSERT_TRUE(plan.WantsPoint(0, Number(2)));
  plan.PointFailed(0, kStart + 2s);
  std::vector<std::uint32_t> due;
  plan.TakeDuePoints(kStart + 2900ms, 10, due);
  EXPECT_TRUE(due.empty());
  plan.TakeDuePoints(kStart + 3s, 10, due);
  EXPECT_EQ(due, std::vector<std::uint32_t>{0});
  EXPECT_TRUE(plan.WantsPoint(0, Number(1)));
}

TEST(PublishPlan, ADeviceStatusIsSentOnceASecond) {
  PublishPlan plan({}, {}, 1, kStart);
  ASSERT_TRUE(plan.WantsDevice(0, bus::DeviceState::online, kStart));
  plan.DeviceSent(0, bus::DeviceState::online, kStart);
  EXPECT_FALSE(plan.WantsDevice(0, bus::DeviceState::online, kStart + 300ms));
  EXPECT_LE(plan.NextDue(), kStart + 1s);
  std::vector<std::uint32_t> due;
  plan.TakeDueDevices(kStart + 999ms, 10, due);
  EXPECT_TRUE(due.empty());
  plan.TakeDueDevices(kStart + 1s, 10, due);
  ASSERT_EQ(due.size(), 1U);
  EXPECT_TRUE(plan.WantsDevice(0, bus::DeviceState::online, kStart + 1s));
}

TEST(PublishPlan, AChangeOfDeviceStateIsSentAtOnce) {
  PublishPlan plan({}, {}, 1, kStart);
  plan.DeviceSent(0, bus::DeviceState::online, kStart);
  EXPECT_TRUE(plan.WantsDevice(0, bus::DeviceState::offline, kStart + 1ms));
}

TEST(PublishPlan, ADeviceHasAHeartbeatToo) {
  PublishPlan plan({.heartbeat = 10s}, {}, 1, kStart);
  plan.DeviceSent(0, bus::DeviceState::online, kStart);
  std::vector<std::uint32_t> due;
  plan.TakeDueDevices(kStart + 7s, 10, due);
  EXPECT_TRUE(due.empty());
  plan.TakeDueDevices(kStart + 10s, 10, due);
  EXPECT_EQ(due.size(), 1U);
}

constexpr Instant kStart{1h};

TEST(Pacer, LetsABurstThroughAndThenSlowsDown) {
  Pacer pacer(50us, 100);
  int burst = 0;
  while (pacer.Take(kStart)) ++burst;
  EXPECT_EQ(burst, 100);
  EXPECT_FALSE(pacer.Take(kStart + 49us));
  EXPECT_TRUE(pacer.Take(kStart + 50us));
}

TEST(Pacer, KeepsItsRateWhenWokenAtTheRequestedTimes) {
  Pacer pacer(50us, 100);
  Instant now = kStart;
  int sent = 0;
  int waits = 0;
  while (now < kStart + 100ms) {
    while (pacer.Take(now)) ++sent;
    ASSERT_GT(pacer.ReadyAt(), now);
    now = pacer.ReadyAt();
    ++waits;
  }
  EXPECT_NEAR(sent, 2000 + 100, 60);
  EXPECT_LE(waits, 45);
}

TEST(PacedWriter, WaitsLongerAfterEachFullWriter) {
  testing::RememberingWriter writer;
  PacedWriter paced(writer, {});
  Instant now = Instant() + 1h;
  writer.answer = Sent::later;
  for (const Duration rest : {1ms, 2ms, 4ms, 8ms, 10ms, 10ms}) {
    ASSERT_TRUE(paced.MayWrite(now));
    EXPECT_EQ(paced.Write(PointSample(), now), Sent::later);
    EXPECT_EQ(paced.ReadyAt(), now + rest);
    EXPECT_FALSE(paced.MayWrite(now + rest - 1us));
    now += rest;
  }
  writer.answer = Sent::yes;
  EXPECT_EQ(paced.Write(PointSample(), now), Sent::yes);
  writer.answer = Sent::later;
  EXPECT_EQ(paced.Write(PointSample(), now), Sent::later);
  EXPECT_EQ(paced.ReadyAt(), now + 1ms);
  paced.ForgetHold();
  EXPECT_TRUE(paced.MayWrite(now)) << "there is a new receiver";
  EXPECT_EQ(paced.written(), 1U);
  EXPECT_EQ(paced.failed(), 0U) << "nothing was refused";
}

TEST(DueQueue, IsEmptyWithoutSlots) {
  DueQueue queue(0, kStart);
  EXPECT_EQ(queue.Due(kStart), std::nullopt);
  EXPECT_EQ(queue.Next(), Instant::max());
}

TEST(DueQueue, ReturnsASlotOnlyWhenItIsDue) {
  DueQueue queue(1, kStart);
  EXPECT_EQ(queue.Due(kStart - 1ns), std::nullopt);
  EXPECT_EQ(queue.Due(kStart), 0U);
  queue.Set(0, kStart + 10s);
  EXPECT_EQ(queue.Due(kStart + 9s), std::nullopt);
  queue.Set(0, kStart + 5s);
  EXPECT_EQ(queue.Due(kStart + 9s), 0U);
}

TEST(DueQueue, AgreesWithAPlainSearch) {
  constexpr std::size_t kCount = 50;
  std::mt19937 random(1);
  DueQueue queue(kCount, kStart);
  std::vector<Instant> plain(kCount, kStart);
  Instant now = kStart;
  for (int step = 0; step < 20'000; ++step) {
    const auto slot = static_cast<std::uint32_t>(random() % kCount);
    const Instant due = now + Duration(random() % 1000);
    queue.Set(slot, due);
    plain[slot] = due;
    now += Duration(random() % 20);
    const auto earliest = std::ranges::min_element(plain);
    ASSERT_LE(queue.Next(), *earliest);
    const auto got = queue.Due(now);
    ASSERT_EQ(got.has_value(), *earliest <= now);
    if (!got) continue;
    ASSERT_LE(plain[*got], now);
    const Instant next = now + 500ns;
    queue.Set(*got, next);
    plain[*got] = next;
  }
}

}  // namespace
}  // namespace baudgate::dds
