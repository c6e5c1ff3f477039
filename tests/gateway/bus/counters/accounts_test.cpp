// Tests of `Accounts`: the news that it reports to the PollerListener, and the status that it
// writes to the point store.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/counters/accounts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/gateway/bus/poller/part_fixture.h"

namespace baudgate::bus {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class AccountsTest : public ::testing::Test, protected PollerListener {
 protected:
  AccountsTest() {
    for (const auto& device : members_.roster.devices()) {
      schedule_.AddDevice(device->config->poll, device->config->slow);
    }
    accounts_.OnTime(At(0s), false, nullptr);
    accounts_.OnOpened();
  }
  void OnDeviceState(std::uint32_t, DeviceState, DeviceState to, const std::string&, Now) override {
    states_.push_back(to);
  }
  void OnWarning(std::uint32_t, const std::string&) override { ++warnings_; }
  void OnNews(News news, Now) override { news_.emplace_back(news.what, news.over); }

  static Now At(Duration at) { return {Instant() + 1h + at, WallTime(1'790'000'000s) + at}; }
  void OnExchange(const ExchangeEnd& end, LineUse use = LineUse::polls) {
    const EndedExchange ended{
        .member = &a_, .end = end, .use = use, .routed = use == LineUse::routes};
    accounts_.devices.OnExchange(ended, At(0s));
    accounts_.line.OnExchange(ended, At(0s));
  }
  DeviceStatus StatusOf(const Member& member) const {
    DeviceStatus status;
    store_.Read(member.index, [&](const DeviceRecord& record) { status = record.status; });
    return status;
  }

  config::Config config_ = ToyConfig();
  PointStore store_{config_};
  ToyMembers members_;
  Device& a_ = members_.a;
  Schedule schedule_;
  Accounts accounts_{members_.roster, schedule_, store_, 0, *this};
  std::vector<DeviceState> states_;
  int warnings_ = 0;
  std::vector<std::pair<News::What, bool>> news_;
};

/// Noise can change one or two echoes, so only three collisions show another master.
TEST_F(AccountsTest, ThreeCollisionsInAMinuteReportAnotherMasterUntilAMinuteHasNone) {
  const std::pair<News::What, bool> began{News::What::collisions, false};
  const std::pair<News::What, bool> ended{News::What::collisions, true};
  EchoWatch::Received collision;
  collision.collision = true;
  for (const Duration at : {0s, 70s, 100s}) {
    accounts_.OnTime(At(at), false, nullptr);
    accounts_.line.OnHeard(collision, nullptr);
  }
  EXPECT_THAT(news_, IsEmpty());
  accounts_.OnTime(At(120s), false, nullptr);
  accounts_.line.OnHeard(collision, nullptr);
  accounts_.line.OnHeard(collision, nullptr);
  EXPECT_THAT(news_, ElementsAre(began));
  accounts_.OnTime(At(179s), false, nullptr);
  EXPECT_THAT(news_, ElementsAre(began));
  accounts_.OnTime(At(180s), false, nullptr);
  accounts_.OnTime(At(300s), false, nullptr);
  EXPECT_THAT(news_, ElementsAre(began, ended));
}

TEST_F(AccountsTest, BusyTimeIsChargedToTheLineAndToTheDevice) {
  accounts_.OnTime(At(3s), true, &a_);
  accounts_.OnTime(At(9s), false, &a_);
  accounts_.OnTime(At(10s), true, nullptr);
  EXPECT_EQ(accounts_.line.counters().busy, 4s);
  OnExchange({Outcome::ok, {}, 20ms, 9});
  EXPECT_EQ(StatusOf(a_).busy, 3s);
}

TEST_F(AccountsTest, LineUseIsReportedForTheLastFullMinute) {
  const auto use = [this] {
    accounts_.line.Show({});
    return store_.ReadLine(0).use;
  };
  accounts_.OnTime(At(6s), true, &a_);
  EXPECT_EQ(use(), 0) << "not worth a word yet";
  accounts_.OnTime(At(12s), false, nullptr);
  EXPECT_DOUBLE_EQ(use(), 0.5);
  accounts_.OnTime(At(60s), false, nullptr);
  EXPECT_DOUBLE_EQ(use(), 0.1);
  accounts_.OnTime(At(90s), true, nullptr);
  EXPECT_DOUBLE_EQ(use(), 0.1);
  accounts_.line.OnClosed();
  EXPECT_EQ(use(), 0);
}

TEST_F(AccountsTest, TheTimeOfAMinuteIsSplitByUse) {
  const ExchangeEnd good{Outcome::ok, {}, 20ms, 9};
  accounts_.OnTime(At(6s), true, &a_);
  OnExchange(good);
  accounts_.OnTime(At(9s), true, &a_);
  OnExchange({Outcome::no_reply, "nothing", {}, 0});
  accounts_.OnTime(At(12s), true, &a_, true);
  accounts_.OnTime(At(18s), true, &a_);
  OnExchange(good, LineUse::routes);
  accounts_.OnTime(At(60s), false, nullptr);
  accounts_.line.Show({});
  const LineShares expected = {0.1, 0, 0.1, 0, 0.05, 0.05};
  const LineShares minute = store_.ReadLine(0).minute;
  for (std::size_t i = 0; i < kLineUses; ++i) {
    EXPECT_DOUBLE_EQ(minute[i], expected[i]) << Name(static_cast<LineUse>(i));
  }
  accounts_.OnTime(At(66s), true, &a_);
  OnExchange(good);
  accounts_.line.Show({});
  EXPECT_EQ(store_.ReadLine(0).spent, (TimeByUse{12s, 0s, 6s, 0s, 3s, 3s})) << "since the start";
  const MinuteCounts counts = StatusOf(a_).hour.Sum(At(18s).instant);
  EXPECT_EQ(counts.answered, 2U);
  EXPECT_EQ(counts.failed, 1U);
  EXPECT_EQ(counts.served, 12s);
  EXPECT_EQ(counts.wasted, 6s);
}

TEST_F(AccountsTest, ExchangesAreCountedForDeviceAndLine) {
  OnExchange({Outcome::ok, {}, 20ms, 9});
  OnExchange({Outcome::no_reply, "nothing", {}, 0});
  const DeviceStatus status = StatusOf(a_);
  EXPECT_EQ(status.exchanges, 2U);
  EXPECT_EQ(status.Count(Outcome::no_reply), 1U);
  EXPECT_EQ(status.last_reason, "nothing");
  EXPECT_EQ(status.round_trips.count(), 1U);
  EXPECT_EQ(accounts_.line.counters().exchanges, 2U);
}

TEST_F(AccountsTest, ALineIsSilentWhenAllRequestsSinceAGivenTimeAreUnanswered) {
  const Instant now = At(0s).instant;
  EXPECT_FALSE(accounts_.line.SilentSince(now));
  OnExchange({Outcome::no_reply, {}, {}, 0});
  accounts_.OnTime(At(5s), false, nullptr);
  OnExchange({Outcome::no_reply, {}, {}, 0});
  EXPECT_TRUE(accounts_.line.SilentSince(now + 1s));
  EXPECT_FALSE(accounts_.line.SilentSince(now + 6s)) << "nothing was asked since";
  OnExchange({Outcome::ok, {}, 20ms, 9});
  EXPECT_FALSE(accounts_.line.SilentSince(now + 1s));
}

TEST_F(AccountsTest, ALineWhoseDeviceSendsUnaskedIsNotSilent) {
  const Instant now = At(0s).instant;
  OnExchange({Outcome::no_reply, {}, {}, 0});
  accounts_.line.OnUnasked(Outcome::ok);
  accounts_.OnTime(At(5s), false, nullptr);
  OnExchange({Outcome::no_reply, {}, {}, 0});
  EXPECT_FALSE(accounts_.line.SilentSince(now + 1s));
  accounts_.OnTime(At(9s), false, nullptr);
  accounts_.line.OnUnasked(Outcome::corrupt);
  OnExchange({Outcome::no_reply, {}, {}, 0});
  EXPECT_TRUE(accounts_.line.SilentSince(now + 6s)) << "noise is no answer";
}

TEST_F(AccountsTest, AStateChangeIsReportedOnce) {
  a_.health.OnTask(Outcome::ok, At(0s).instant);
  accounts_.states.OnState(a_, "ok");
  accounts_.states.OnState(a_, "ok");
  EXPECT_THAT(states_, ElementsAre(DeviceState::online));
  accounts_.states.OnClosed(Quality::bad_not_connected);
  EXPECT_THAT(states_, ElementsAre(DeviceState::online)) << "the port has a line in the log";
  EXPECT_EQ(StatusOf(a_).state, DeviceState::offline);
}

TEST_F(AccountsTest, EverySecondReplyIsCountedAndOnlyTheFirstIsWarnedOf) {
  accounts_.devices.OnSecondReply(a_);
  accounts_.devices.OnSecondReply(a_);
  EXPECT_EQ(StatusOf(a_).doubled, 2U);
  EXPECT_EQ(warnings_, 1);
}

}  // namespace
}  // namespace baudgate::bus
