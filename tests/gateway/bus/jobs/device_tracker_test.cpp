// Tests of `DeviceTracker`: what follows when a device appears, disappears, or is replaced.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/device_tracker.h"

#include <gtest/gtest.h>

#include "tests/gateway/bus/poller/part_fixture.h"
#include "tests/support/times.h"

namespace baudgate::bus {
namespace {

class DeviceTrackerTest : public ::testing::Test, protected ToyMembers, protected PollerListener {
 protected:
  void OnDeviceState(std::uint32_t, DeviceState, DeviceState to, const std::string&, Now) override {
    state_ = to;
  }
  void OnWarning(std::uint32_t, const std::string&) override {}

  void Open() {
    accounts_.OnTime({kStart, WallTime(1'790'000'000s)}, false, nullptr);
    tracker_.OnOpened(kStart);
  }
  void Fail(Duration at) { tracker_.OnTask(a, Outcome::no_reply, "silence", kStart + at); }
  void Answer(Duration at) { tracker_.OnTask(a, Outcome::ok, {}, kStart + at); }
  void GoOffline() {
    Answer(0s);
    Fail(1s);
    Fail(2s);
    Fail(3s);
  }
  void Read(Device& device) {
    Sample sample;
    sample.point = 0;
    sample.value = 1.0;
    sample.quality = Quality::good;
    store_.Update(device.index, {&sample, 1}, {kStart, WallTime(1'790'000'000s)}, 20ms);
  }
  Quality QualityOf(const Device& device) const {
    Quality quality{};
    store_.Read(device.index,
                [&](const DeviceRecord& record) { quality = QualityAt(record, 0, kStart); });
    return quality;
  }
  std::string Due(Duration at) {
    std::string due;
    while (const auto pick = schedule_.Next(kStart + at)) due += pick->device == 0 ? 'a' : 'b';
    return due;
  }

  config::Config config_ = ToyConfig();
  PointStore store_{config_};
  OwedReplies owed_{roster};
  Agenda agenda_{roster, owed_.late_replies};
  Schedule& schedule_ = agenda_.schedule;
  Accounts accounts_{roster, schedule_, store_, 0, *this};
  DeviceTracker tracker_{roster, store_, owed_, agenda_, accounts_};
  DeviceState state_ = DeviceState::never_seen;
};

TEST_F(DeviceTrackerTest, NothingIsPolledBeforeThePortOpens) {
  EXPECT_EQ(Due(0s), "");
  Open();
  EXPECT_EQ(Due(0s), "aba") << "two queries of a, one of b";
}

TEST_F(DeviceTrackerTest, ADeviceOutOfUseIsNotPolledAfterThePortOpens) {
  tracker_.SetInUse(a, false, false, kStart);
  Open();
  EXPECT_EQ(Due(0s), "b");
}

/// The port closed before device a replied. The late reply can arrive until the ceiling, the
/// timeout of a whole exchange.
TEST_F(DeviceTrackerTest, AfterThePortOpensOnlyTheDeviceWithALateReplyWaits) {
  owed_.late_replies.OnClosed(a, kStart - 100ms);
  Open();
  EXPECT_EQ(Due(0s), "b");
  EXPECT_EQ(Due(900ms).substr(0, 1), "a") << "the ceiling is 1 s";
}

TEST_F(DeviceTrackerTest, AnOfflineDeviceIsNotPolledAndItsValuesAreNotGood) {
  Open();
  Read(a);
  Read(b);
  ASSERT_EQ(QualityOf(a), Quality::good);
  GoOffline();
  EXPECT_EQ(state_, DeviceState::offline);
  EXPECT_EQ(Due(3s), "b");
  EXPECT_NE(QualityOf(a), Quality::good) << "it may be another one when it is back";
  EXPECT_EQ(QualityOf(b), Quality::good);
}

TEST_F(DeviceTrackerTest, AReturningDeviceIsPolledAtOnce) {
  Open();
  GoOffline();
  Due(3s);
  Answer(3100ms);
  EXPECT_EQ(state_, DeviceState::online);
  EXPECT_EQ(Due(3100ms), "aa");
}

TEST_F(DeviceTrackerTest, ADeviceTakenIntoUseIsPolledAndItsOldValuesAreNotGood) {
  Open();
  Read(a);
  Due(0s);
  tracker_.SetInUse(a, false, true, kStart);
  EXPECT_EQ(Due(1s), "b");
  tracker_.SetInUse(a, true, true, kStart + 1s);
  EXPECT_EQ(Due(1s), "aa");
  EXPECT_NE(QualityOf(a), Quality::good);
}

TEST_F(DeviceTrackerTest, ADeviceOutOfUseIsNotPolledWhateverItsLastReply) {
  const protocols::Task poll;
  const protocols::Request request = AskFor("?A1\r");
  Open();
  a.conversation->OnFrame(poll, request, ToyReply("A1~foreign"), kStart);
  tracker_.OnHeard(a, kStart);
  Due(0s);
  tracker_.SetInUse(a, false, true, kStart);
  a.conversation->OnFrame(poll, request, ToyReply("A1=5"), kStart);
  tracker_.OnHeard(a, kStart);
  EXPECT_EQ(Due(1s), "b") << "it is the right one again";
  tracker_.OnReplaced(a, {kStart, kWall});
  EXPECT_EQ(Due(2s), "b") << "it tells another name";
}

TEST_F(DeviceTrackerTest, EntriesOfTheSameSenderWaitTogether) {
  Open();
  a.sender = b.sender = ToBytes("A");
  owed_.late_replies.OnClosed(a, kStart);
  tracker_.HoldBack(a);
  EXPECT_EQ(Due(900ms), "");
  EXPECT_NE(Due(1s), "");
}

}  // namespace
}  // namespace baudgate::bus
