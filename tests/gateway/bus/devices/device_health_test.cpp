// Tests of `DeviceHealth`, `HeardPoints`, `Roster` and `DeviceStates`.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/devices/device_health.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/bus/counters/accounts.h"
#include "gateway/bus/devices/roster.h"
#include "tests/gateway/bus/poller/part_fixture.h"
#include "tests/support/times.h"
#include "tests/support/virtual_line.h"

namespace baudgate::bus {
namespace {

class DeviceHealthTest : public ::testing::Test {
 protected:
  void Task(Outcome outcome, Duration at) {
    health_.OnExchange(outcome);
    health_.OnTask(outcome, baudgate::kStart + at);
  }
  DeviceHealth health_;
};

TEST_F(DeviceHealthTest, NeverSeenUntilTheFirstAnswer) {
  EXPECT_EQ(health_.state(), DeviceState::never_seen);
  EXPECT_FALSE(health_.absent()) << "its first poll is no probe";
  Task(Outcome::no_reply, 0s);
  EXPECT_EQ(health_.state(), DeviceState::never_seen);
  EXPECT_TRUE(health_.absent());
  Task(Outcome::ok, 1s);
  EXPECT_EQ(health_.state(), DeviceState::online);
  EXPECT_FALSE(health_.absent());
}

TEST_F(DeviceHealthTest, AnyAnswerMakesADeviceOnline) {
  for (const Outcome outcome : {Outcome::busy, Outcome::refused, Outcome::unsupported}) {
    health_ = {};
    Task(outcome, 0s);
    EXPECT_EQ(health_.state(), DeviceState::online) << Name(outcome);
  }
}

TEST_F(DeviceHealthTest, NoiseDoesNotMakeADeviceOnline) {
  for (const Outcome outcome : {Outcome::partial, Outcome::corrupt, Outcome::unexpected}) {
    health_ = {};
    Task(outcome, 0s);
    EXPECT_EQ(health_.state(), DeviceState::never_seen) << Name(outcome);
  }
}

TEST_F(DeviceHealthTest, ABurstOfFailuresIsNotEnoughForOffline) {
  Task(Outcome::ok, 0s);
  for (int i = 0; i < 20; ++i) Task(Outcome::no_reply, 1s + i * 50ms);
  EXPECT_EQ(health_.state(), DeviceState::degraded);
  Task(Outcome::no_reply, 2s);
  EXPECT_EQ(health_.state(), DeviceState::offline);
}

TEST_F(DeviceHealthTest, TwoFailuresFarApartAreNotEnoughForOffline) {
  Task(Outcome::ok, 0s);
  Task(Outcome::no_reply, 1min);
  Task(Outcome::no_reply, 10min);
  EXPECT_EQ(health_.state(), DeviceState::degraded);
  Task(Outcome::no_reply, 20min);
  EXPECT_EQ(health_.state(), DeviceState::offline);
}

TEST_F(DeviceHealthTest, AnAnswerResetsTheFailureCount) {
  Task(Outcome::ok, 0s);
  for (int i = 1; i < 30; ++i) {
    Task(Outcome::no_reply, i * 3s);
    Task(Outcome::no_reply, i * 3s + 1s);
    Task(Outcome::ok, i * 3s + 2s);
    EXPECT_NE(health_.state(), DeviceState::offline);
  }
}

TEST_F(DeviceHealthTest, AReturningDeviceIsOnlineAtOnce) {
  Task(Outcome::ok, 0s);
  for (int i = 1; i < 40; ++i) Task(Outcome::no_reply, i * 1s);
  ASSERT_EQ(health_.state(), DeviceState::offline);
  Task(Outcome::ok, 100s);
  EXPECT_EQ(health_.state(), DeviceState::online) << "the failures of its absence are forgotten";
}

TEST_F(DeviceHealthTest, FrequentSuccessfulRetriesMakeADeviceDegraded) {
  Task(Outcome::ok, 0s);
  for (int failures = 1; failures <= 3; ++failures) {
    health_.OnExchange(Outcome::corrupt);
    Task(Outcome::ok, 1s);
    EXPECT_EQ(health_.state(), failures < 3 ? DeviceState::online : DeviceState::degraded);
  }
  for (int i = 0; i < 32; ++i) Task(Outcome::ok, 2s);
  EXPECT_EQ(health_.state(), DeviceState::online);
}

TEST_F(DeviceHealthTest, ALostPortDoesNotChangeTheDeviceState) {
  Task(Outcome::ok, 0s);
  for (int i = 0; i < 50; ++i) Task(Outcome::line_down, i * 1s);
  EXPECT_EQ(health_.state(), DeviceState::online);
}

TEST_F(DeviceHealthTest, TwoRefusalsInARowMarkADeviceAsRefusing) {
  for (const Outcome refusal : {Outcome::refused, Outcome::unsupported}) {
    health_ = {};
    Task(refusal, 0s);
    EXPECT_FALSE(health_.refuses()) << Name(refusal);
    Task(Outcome::line_down, 1s);
    Task(refusal, 2s);
    EXPECT_TRUE(health_.refuses()) << Name(refusal);
    Task(Outcome::busy, 3s);
    Task(refusal, 4s);
    EXPECT_FALSE(health_.refuses()) << "it had something else to say";
  }
}

const std::vector<std::size_t> kHeard = {0, 1};
const std::vector<std::size_t> kNever = {2, 3};
constexpr Instant kStart{100s};

TEST(HeardPoints, SilenceToAnsweredPointsCountsAgainstTheDevice) {
  HeardPoints points;
  EXPECT_TRUE(points.TellsOfDevice(kNever, kStart)) << "nothing has ever come";
  points.OnValue(1, kStart);
  EXPECT_TRUE(points.TellsOfDevice(kHeard, kStart + 1s));
  EXPECT_FALSE(points.TellsOfDevice(kNever, kStart + 1s));
}

TEST(HeardPoints, AnySilenceCountsAgainstADeviceLongAfterItsLastValue) {
  HeardPoints points;
  points.OnValue(0, kStart);
  EXPECT_FALSE(points.TellsOfDevice(kNever, kStart + 10s));
  EXPECT_TRUE(points.TellsOfDevice(kNever, kStart + 11s));
  points.OnValue(0, kStart + 12s);
  EXPECT_FALSE(points.TellsOfDevice(kNever, kStart + 13s));
}

TEST(HeardPoints, AnySilenceCountsAgainstALateDeviceForTenMinutes) {
  HeardPoints points;
  points.OnLate(kStart);
  points.OnValue(0, kStart + 1s);
  EXPECT_TRUE(points.TellsOfDevice(kNever, kStart + 2s));
  points.OnValue(0, kStart + 599s);
  EXPECT_TRUE(points.TellsOfDevice(kNever, kStart + 599s));
  EXPECT_FALSE(points.TellsOfDevice(kNever, kStart + 600s));
}

TEST(HeardPoints, AReconnectForgetsAnsweredPointsAndLateness) {
  HeardPoints points;
  points.OnValue(1, kStart);
  points.OnLate(kStart);
  points.Clear();
  EXPECT_TRUE(points.TellsOfDevice(kNever, kStart));
  points.OnValue(2, kStart);
  EXPECT_FALSE(points.TellsOfDevice({3}, kStart)) << "that one has never been late";
  EXPECT_FALSE(points.TellsOfDevice(kHeard, kStart)) << "and has not answered these";
}

TEST(Roster, DevicesKeepTheOrderOfTheConfiguration) {
  config::Line line = ToyLine({ToyDevice("a", "A", {"1"}), ToyDevice("b", "B", {"1"})});
  line.retries = 5;
  line.devices[1].retries = 1;
  line.devices[1].enabled = false;
  const Roster roster(
      line, 7, [](const std::string&) -> const protocols::Protocol& { return ToyProtocol(); });
  ASSERT_EQ(roster.devices().size(), 2U);
  EXPECT_EQ(roster.device(0).index, 7U);
  EXPECT_EQ(&roster.DeviceAt(8), &roster.device(1));
  EXPECT_EQ(roster.device(1).place, 1U);
  EXPECT_EQ(roster.device(0).max_retries, 5);
  EXPECT_EQ(roster.device(1).max_retries, 1) << "its own go before the line's";
  EXPECT_FALSE(roster.device(1).in_use);
  EXPECT_EQ(roster.everyone()[1]->device, &roster.device(1));
}

TEST(Roster, ALineWithoutModbusHasNoCarrierAndNoSlaves) {
  const ToyMembers toys;
  EXPECT_EQ(toys.roster.carrier(), nullptr);
  EXPECT_EQ(toys.roster.FindSlave(1), nullptr);
}

TEST(Roster, EntriesWithEqualSenderNamesAreTheSameDevice) {
  ToyMembers toys;
  EXPECT_TRUE(toys.a.IsSame(toys.a));
  EXPECT_FALSE(toys.a.IsSame(toys.b)) << "nothing is known of their names";
  toys.a.sender = toys.b.sender = ToBytes("A");
  EXPECT_TRUE(toys.a.IsSame(toys.b));
}

class Slow : public protocols::Conversation {
 public:
  explicit Slow(config::Timing least) : least_(least) {}
  std::span<const protocols::Query> Queries() const override { return {}; }
  Result<protocols::Request> Ask(const protocols::Task&, Instant) override {
    return Error{"not asked"};
  }
  protocols::Answer OnFrame(const protocols::Task&, const protocols::Request&, View,
                            Instant) override {
    return {};
  }
  Outcome Check(View, View) const override { return Outcome::ok; }
  protocols::Answer Interpret(View, View) override { return {}; }
  config::Timing LeastTimes(Duration) const override { return least_; }

 private:
  config::Timing least_;
};

TEST(RosterTimes, TheLongerOfConfiguredAndConversationTimesApplies) {
  const config::Line line = ToyLine({ToyDevice("a", "A", {"1"})});
  Roster roster(line, 0,
                [](const std::string&) -> const protocols::Protocol& { return ToyProtocol(); });
  Device& device = roster.device(0);
  const LineTimes configured = device.times;

  config::Timing least;
  least.quiet = configured.quiet + 40ms;
  least.reply = configured.reply + 2s;
  least.drain = configured.drain / 2;
  device.conversation = std::make_unique<Slow>(least);
  device.LearnTimes();
  EXPECT_EQ(device.times.quiet, configured.quiet + 40ms);
  EXPECT_EQ(device.times.reply, configured.reply + 2s);
  EXPECT_EQ(device.times.drain, configured.drain);
  EXPECT_EQ(device.times.gap, configured.gap);
  EXPECT_EQ(device.times.ceiling, configured.ceiling + 2s) << "it begins later, and takes as long";
  device.LearnTimes();
  EXPECT_EQ(device.times.ceiling, configured.ceiling + 2s) << "once";

  device.conversation = std::make_unique<Slow>(config::Timing());
  device.LearnTimes();
  EXPECT_EQ(device.times.quiet, configured.quiet);
  EXPECT_EQ(device.times.reply, configured.reply);
  EXPECT_EQ(device.times.ceiling, configured.ceiling);
}

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class Saying final : public protocols::Conversation {
 public:
  std::span<const protocols::Query> Queries() const override { return {}; }
  Result<protocols::Request> Ask(const protocols::Task&, Instant) override {
    return Error{"nothing to ask"};
  }
  protocols::Answer OnFrame(const protocols::Task&, const protocols::Request&, View,
                            Instant) override {
    return {};
  }
  Outcome Check(View, View) const override { return Outcome::ok; }
  protocols::Answer Interpret(View, View) override { return {}; }
  const protocols::DeviceTrouble& trouble() const override { return says; }

  protocols::DeviceTrouble says;
};

class DeviceStatesTest : public ::testing::Test, protected PollerListener {
 protected:
  void Make() {
    PollerListener& listener = *this;
    states_.emplace(members_.roster, store_, listener);
  }
  DeviceStatus Status() const {
    DeviceStatus status;
    store_.Read(0, [&](const DeviceRecord& record) { status = record.status; });
    return status;
  }
  std::vector<std::string> Told() { return std::exchange(told_, {}); }
  std::vector<std::string> Warned() { return std::exchange(warned_, {}); }

  ToyMembers members_;
  config::Config config_ = ToyConfig();
  PointStore store_{config_};
  std::optional<DeviceStates> states_;

 private:
  void OnDeviceState(std::uint32_t, DeviceState from, DeviceState to, const std::string& reason,
                     Now) override {
    told_.push_back(std::string(Name(from)) + " -> " + std::string(Name(to)) + ": " + reason);
  }
  void OnNews(News news, Now) override { told_.push_back((news.over ? "over: " : "") + news.text); }
  void OnWarning(std::uint32_t, const std::string& message) override { warned_.push_back(message); }

  std::vector<std::string> told_;
  std::vector<std::string> warned_;
};

TEST_F(DeviceStatesTest, ADisabledDeviceIsTakenIntoUse) {
  members_.a.in_use = false;
  Make();
  store_.UpdateStatus(0, [](DeviceStatus& status) { status.state = DeviceState::disabled; });
  states_->OnState(members_.a, "taken out of use");
  EXPECT_THAT(Told(), IsEmpty()) << "it was";
  members_.a.in_use = true;
  states_->OnState(members_.a, "taken into use");
  EXPECT_THAT(Told(), ElementsAre("disabled -> never seen: taken into use"));
  EXPECT_EQ(Status().state, DeviceState::never_seen);
}

TEST_F(DeviceStatesTest, ARemarkIsWarnedOfButNotReportedAsTrouble) {
  const std::string wrong = "type 0D, the profile has 08";
  const std::string remark = "gives no events";
  struct Row {
    protocols::DeviceTrouble says;
    std::vector<std::string> told;
    std::vector<std::string> warned;
  };
  const Row rows[] = {
      {{Reason::none, remark}, {}, {remark}},
      {{Reason::none, ""}, {}, {"this trouble is over: " + remark}},
      {{Reason::other_module, wrong}, {wrong}, {wrong}},
      {{Reason::other_module, wrong}, {}, {}},
      {{Reason::none, remark}, {"over: "}, {"the configured device answers again; " + remark}},
      {{Reason::other_module, wrong}, {wrong}, {wrong}},
      {{Reason::other_module, "type 0E"}, {"type 0E"}, {"type 0E"}},
      {{Reason::none, ""}, {"over: "}, {"the configured device answers again"}},
      {{Reason::none, wrong}, {}, {wrong}},
      {{Reason::other_module, wrong}, {wrong}, {wrong}},
      {{Reason::none, wrong}, {"over: "}, {"the configured device answers again; " + wrong}},
  };
  auto conversation = std::make_unique<Saying>();
  Saying& device = *conversation;
  members_.a.conversation = std::move(conversation);
  Make();
  for (const Row& row : rows) {
    device.says = row.says;
    states_->OnTrouble(members_.a);
    EXPECT_EQ(Told(), row.told) << row.says.text;
    EXPECT_EQ(Warned(), row.warned) << row.says.text;
    EXPECT_EQ(Status().trouble, row.says.text);
  }
}

}  // namespace
}  // namespace baudgate::bus
