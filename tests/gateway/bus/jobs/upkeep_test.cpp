// What follows when a device comes, goes, or may be another one.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/upkeep.h"

#include <gtest/gtest.h>

#include "tests/gateway/bus/poller/part_fixture.h"
#include "tests/support/times.h"

namespace baudgate {
namespace {

class UpkeepTest : public ::testing::Test, protected ToyMembers, protected PollerListener {
 protected:
  void OnDeviceState(std::uint32_t, DeviceState, DeviceState to, const std::string&, Now) override {
    state_ = to;
  }
  void OnWarning(std::uint32_t, const std::string&) override {}

  void Open() {
    ledger_.OnTime({kStart, WallTime(1'790'000'000s)}, false, nullptr);
    upkeep_.OnOpened(kStart);
  }
  void Fail(Duration at) { upkeep_.OnTask(a, Outcome::no_reply, "silence", kStart + at); }
  void Answer(Duration at) { upkeep_.OnTask(a, Outcome::ok, {}, kStart + at); }
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
  /// Devices whose polls are due, in the order in which they are served.
  std::string Due(Duration at) {
    std::string due;
    while (const auto pick = schedule_.Next(kStart + at)) due += pick->device == 0 ? 'a' : 'b';
    return due;
  }

  config::Config config_ = ToyConfig();
  PointStore store_{config_};
  OwedReplies owed_{roster};
  Agenda agenda_{roster, owed_.late};
  Schedule& schedule_ = agenda_.schedule;
  Ledger ledger_{roster, schedule_, store_, 0, *this};
  Upkeep upkeep_{roster, store_, owed_, agenda_, ledger_};
  DeviceState state_ = DeviceState::never_seen;
};

TEST_F(UpkeepTest, NothingIsPolledBeforeThePortOpens) {
  EXPECT_EQ(Due(0s), "");
  Open();
  EXPECT_EQ(Due(0s), "aba") << "two queries of a, one of b";
}

TEST_F(UpkeepTest, AtTheOpeningADeviceOutOfUseIsLeftAlone) {
  upkeep_.SetInUse(a, false, false, kStart);
  Open();
  EXPECT_EQ(Due(0s), "b");
}

/// The reply to what it was asked before the port closed may still come.
TEST_F(UpkeepTest, AtTheOpeningALateReplyKeepsItsDeviceWaitingOnly) {
  owed_.late.OnClosed(a, kStart - 100ms);
  Open();
  EXPECT_EQ(Due(0s), "b");
  EXPECT_EQ(Due(900ms).substr(0, 1), "a") << "the ceiling is 1 s";
}

TEST_F(UpkeepTest, AnOfflineDeviceIsNotPolledAndItsValuesAreDoubted) {
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

TEST_F(UpkeepTest, WhoIsBackIsPolledAtOnce) {
  Open();
  GoOffline();
  Due(3s);
  Answer(3100ms);
  EXPECT_EQ(state_, DeviceState::online);
  EXPECT_EQ(Due(3100ms), "aa");
}

TEST_F(UpkeepTest, TakenIntoUseADeviceIsPolledAndHasToSayItsValuesAnew) {
  Open();
  Read(a);
  Due(0s);
  upkeep_.SetInUse(a, false, true, kStart);
  EXPECT_EQ(Due(1s), "b");
  upkeep_.SetInUse(a, true, true, kStart + 1s);
  EXPECT_EQ(Due(1s), "aa");
  EXPECT_NE(QualityOf(a), Quality::good);
}

/// The exchange under way was sent before.
TEST_F(UpkeepTest, OutOfUseADeviceIsNotPolledWhateverItsLastReplySays) {
  const Task poll;
  const Request request = AskFor("?A1\r");
  Open();
  a.conversation->OnFrame(poll, request, ToyReply("A1~foreign"), kStart);
  upkeep_.OnHeard(a, kStart);
  Due(0s);
  upkeep_.SetInUse(a, false, true, kStart);
  a.conversation->OnFrame(poll, request, ToyReply("A1=5"), kStart);
  upkeep_.OnHeard(a, kStart);
  EXPECT_EQ(Due(1s), "b") << "it is the right one again";
  upkeep_.OnReplaced(a, {kStart, kWall});
  EXPECT_EQ(Due(2s), "b") << "it tells another name";
}

TEST_F(UpkeepTest, WhoCannotBeToldApartOnTheWireWaitsToo) {
  Open();
  a.sender = b.sender = ToBytes("A");
  owed_.late.OnClosed(a, kStart);
  upkeep_.HoldBack(a);
  EXPECT_EQ(Due(900ms), "");
  EXPECT_NE(Due(1s), "");
}

}  // namespace
}  // namespace baudgate
