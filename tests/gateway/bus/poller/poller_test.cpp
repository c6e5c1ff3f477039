// Tests of polls of a whole line, under virtual time.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/poller/poller.h"

#include <gtest/gtest.h>

#include <utility>

#include "tests/gateway/bus/poller/poller_fixture.h"
#include "tests/support/virtual_line.h"

namespace baudgate::bus {
namespace {

TEST(Poller, PollsOnTheGridAndStoresGoodValues) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1", "2"})}), {&ToyProtocol()});
  line.twin(0).values.Set(0, 1.5);
  line.twin(0).values.Set(1, -2.0);
  const Instant opened = line.now().instant;
  line.Open();
  line.RunFor(10s - 1ms);
  EXPECT_EQ(line.CountSent("?A1"), 10U);
  EXPECT_EQ(line.CountSent("?A2"), 10U);
  for (const Sent& sent : line.sent) {
    if (sent.text == "?A1\r" && sent.at > opened + 500ms) {
      EXPECT_LE((sent.at - opened) % 1s, 30ms) << "drifts";
    }
  }
  EXPECT_EQ(line.ValueOf(0, 0), Value(1.5));
  EXPECT_EQ(line.ValueOf(0, 1), Value(-2.0));
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
  const DeviceStatus status = line.StatusOf(0);
  EXPECT_EQ(status.state, DeviceState::online);
  EXPECT_GE(status.exchanges, 20U);
  EXPECT_LE(status.exchanges, 24U) << "20 polls, and the probes that go first";
  EXPECT_EQ(status.Count(Outcome::ok), status.exchanges);
  EXPECT_EQ(status.missed, 0U);
  EXPECT_GT(status.round_trips.mean(), 10ms) << "4 + 9 characters at 9600 bit/s and 5 ms to think";
  EXPECT_LT(status.round_trips.mean(), 30ms);
}

TEST(Poller, AnyFragmentationGivesTheSameValue) {
  for (const std::size_t fragment : {1U, 2U, 3U, 5U}) {
    VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
    line.twin(0).values.Set(0, 7.25);
    line.twin(0).manner.fragment = fragment;
    line.twin(0).manner.pause = 10ms;
    line.Open();
    line.RunFor(5s);
    EXPECT_EQ(line.ValueOf(0, 0), Value(7.25));
    EXPECT_EQ(line.StatusOf(0).Count(Outcome::ok), line.StatusOf(0).exchanges);
  }
}

TEST(Poller, ADisabledDeviceIsNotPolled) {
  config::Device off = ToyDevice("b", "B", {"1"});
  off.enabled = false;
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"}), off}), {&ToyProtocol()});
  line.Open();
  line.RunFor(5s);
  line.Close();
  line.Open();
  line.RunFor(5s);
  EXPECT_EQ(line.twin(1).answered, 0U);
  EXPECT_EQ(line.QualityOf(1, 0), Quality::bad_out_of_service);
  EXPECT_EQ(line.StatusOf(1).state, DeviceState::disabled);
  EXPECT_EQ(line.StatusOf(1).last_outcome, Outcome::none);
}

TEST(Poller, MissedPeriodsAreCounted) {
  VirtualLine line(ToyLine({Polled(ToyDevice("a", "A", {"1", "2", "3", "4"}), 40ms)}),
                   {&ToyProtocol()});
  line.Open();
  line.RunFor(10s);
  EXPECT_GT(line.StatusOf(0).missed, 50U);
  EXPECT_EQ(line.QualityOf(0, 3), Quality::good) << "max_age follows the measured cycle";
}

TEST(Poller, ALineWithoutDevicesIsIdleForEver) {
  VirtualLine line(ToyLine({}), {&ToyProtocol()});
  line.Open();
  line.Inject(ToBytes("noise"), 1s);
  line.RunFor(1min);
  EXPECT_FALSE(line.poller().Deadline());
  EXPECT_EQ(line.poller().accounts().line.counters().stray_bytes, 5U);
}

TEST(Poller, SilenceOfTheWholeLineIsReported) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
  line.Open();
  line.RunFor(10s);
  EXPECT_FALSE(line.poller().accounts().line.SilentSince(line.now().instant - 2s));
  line.twin(0).manner.dead = true;
  line.RunFor(30s);
  EXPECT_TRUE(line.poller().accounts().line.SilentSince(line.now().instant - 20s));
}

TEST(Poller, ABusyReplyParksTheQueryAndLaterRepeatsIt) {
  config::Device device = ToyDevice("a", "A", {"1"});
  VirtualLine line(ToyLine({Polled(device, 10s), ToyDevice("b", "B", {"1"})}), {&ToyProtocol()});
  int busy = 2;
  line.twin(0).values.Set(0, 4.0);
  line.twin(0).manner.instead = [&](View request) -> std::optional<Bytes> {
    if (busy == 0 || request[0] != '?') return std::nullopt;
    --busy;
    return ToyReply("A1~busy");
  };
  line.Open();
  line.RunFor(500ms);
  EXPECT_EQ(line.CountSent("?A1"), 3U) << "two pauses, then the value, long before the next period";
  EXPECT_EQ(line.ValueOf(0, 0), Value(4.0));
  EXPECT_EQ(line.StatusOf(0).Count(Outcome::busy), 2U);
  EXPECT_EQ(line.ValueOf(1, 0), Value(0.0)) << "the others were asked meanwhile";
}

TEST(Poller, AnAlwaysBusyDeviceStaysOnlineAndItsPausesAreObserved) {
  config::Line config = ToyLine({ToyDevice("a", "A", {"1", "2"})});
  config.retries = 20;
  VirtualLine line(config, {&ToyProtocol()});
  Say(line.twin(0), "busy");
  line.Open();
  line.RunFor(60s);
  EXPECT_EQ(line.StatusOf(0).state, DeviceState::online);
  EXPECT_EQ(line.StatusOf(0).Count(Outcome::busy), line.StatusOf(0).exchanges - 4) << "the probes";
  EXPECT_LE(line.sent.size(), 60s / 50ms) << "the pause that it asked for is kept";
  EXPECT_EQ(line.StatusOf(0).findings.Last(Symptom::refusal).outcome, Outcome::busy);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_waiting);
}

TEST(Poller, APauseRequestedInAProbeReplyIsObserved) {
  config::Device device = ToyDevice("a", "A", {"1"});
  device.options.Set("wait", std::int64_t{Duration(5min).count()});
  VirtualLine line(ToyLine({device}), {&ToyProtocol()});
  line.twin(0).manner.instead = [](View) -> std::optional<Bytes> { return ToyReply("A0~busy"); };
  line.Open();
  line.RunFor(4min);
  EXPECT_EQ(line.sent.size(), 1U);
}

TEST(Poller, PausesOfABusyDeviceDoNotLengthenItsAgeLimits) {
  config::Device device = ToyDevice("a", "A", {"1"});
  device.options = ToyOptions();
  device.options.Set("wait", std::int64_t{Duration(15s).count()});
  VirtualLine line(ToyLine({device}), {&ToyProtocol()});
  line.Open();
  line.RunFor(5s);
  int busy = 2;
  line.twin(0).manner.instead = [&busy](View request) -> std::optional<Bytes> {
    if (request[0] != '?' || busy-- <= 0) return std::nullopt;
    return ToyReply("A1~busy");
  };
  line.always = [&] {
    line.store().Read(0, [](const DeviceRecord& record) {
      EXPECT_EQ(record.age_limits[static_cast<std::size_t>(config::Group::fast)].uncertain_after,
                3s);
    });
  };
  line.RunFor(1min);
  EXPECT_LT(busy, 0);
}

VirtualLine OneOnce() {
  config::Device device = ToyDevice("a", "A", {"1", "2"});
  device.points[0].group = config::Group::once;
  device.slow = 1min;
  return {ToyLine({device}), {&ToyProtocol()}};
}

void Swallow(VirtualLine::WireTwin& twin, std::string start, int times) {
  twin.manner.instead = [start = std::move(start), times](View request) mutable {
    if (!AsText(request).starts_with(start) || times == 0) return std::optional<Bytes>();
    --times;
    return std::optional(Bytes());
  };
}

TEST(PollerOnce, APointIsReadOncePerPortOpening) {
  VirtualLine line = OneOnce();
  line.Open();
  line.RunFor(1h);
  EXPECT_EQ(line.CountSent("?A1"), 1U);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
  line.Close();
  line.Open();
  line.RunFor(10s);
  EXPECT_EQ(line.CountSent("?A1"), 2U) << "it may have been replaced";
}

TEST(PollerOnce, ALostReadIsRepeatedLater) {
  VirtualLine line = OneOnce();
  Swallow(line.twin(0), "?A1", 3);
  line.Open();
  line.RunFor(50s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_waiting);
  EXPECT_EQ(line.CountSent("?A1"), 3U) << "two retries";
  line.RunFor(30s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
  line.RunFor(1h);
  EXPECT_EQ(line.CountSent("?A1"), 4U);
}

TEST(PollerOnce, AnUnansweredPointIsRequestedOncePerSlowPeriod) {
  VirtualLine line = OneOnce();
  Swallow(line.twin(0), "?A1", -1);
  line.Open();
  line.RunFor(1h);
  const std::size_t tasks = line.CountSent("?A1") / 3;
  EXPECT_GE(tasks, 50U);
  EXPECT_LE(tasks, 61U);
}

TEST(PollerOnce, AValueFromBeforeAReopeningIsNotGoodUntilReadAgain) {
  VirtualLine line = OneOnce();
  line.twin(0).values.Set(0, 1001.0);
  line.Open();
  line.RunFor(10s);
  ASSERT_EQ(line.QualityOf(0, 0), Quality::good);
  line.Close();
  line.RunFor(1s);
  line.twin(0).values.Set(0, 2002.0);
  Swallow(line.twin(0), "?A1", 3);
  line.Open();
  line.always = [&] {
    if (line.QualityOf(0, 0) == Quality::good) {
      EXPECT_EQ(line.ValueOf(0, 0), Value(2002.0));
    }
  };
  line.RunFor(2min);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
}

TEST(PollerOnce, AWriteOnlyPointIsWaitingAfterADeviceSwap) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1", "V2"})}), {&ToyProtocol()});
  line.Open();
  line.RunFor(10s);
  line.twin(0).manner.instead = [](View request) -> std::optional<Bytes> {
    if (AsText(request) != "PA0\r") return std::nullopt;
    return ToyReply("A0=2");
  };
  bool swapped = false;
  line.always = [&] {
    swapped = swapped || line.QualityOf(0, 0).reason == Reason::swapped;
    EXPECT_EQ(line.QualityOf(0, 1), Quality::bad_waiting) << "nobody would read it again";
  };
  line.RunFor(2min);
  EXPECT_TRUE(swapped);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
}

TEST(PollerOnce, AValueIsUncertainUntilReadAgainAfterTakingIntoUse) {
  VirtualLine line = OneOnce();
  line.Open();
  line.RunFor(10s);
  line.poller().SetInUse(0, false, line.now());
  line.RunFor(1s);
  Swallow(line.twin(0), "?A1", 3);
  line.poller().SetInUse(0, true, line.now());
  EXPECT_EQ(line.QualityOf(0, 0), Quality::uncertain);
  EXPECT_EQ(line.QualityOf(0, 1), Quality::uncertain);
  line.RunFor(10s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::uncertain);
  EXPECT_EQ(line.QualityOf(0, 1), Quality::good);
}

VirtualLine OneDaily() {
  config::Device device = ToyDevice("a", "A", {"1", "2"});
  device.points[0].group = config::Group::daily;
  return {ToyLine({device}), {&ToyProtocol()}};
}

TEST(PollerDaily, APointIsReadAtTheStartAndOnceADay) {
  VirtualLine line = OneDaily();
  line.Open();
  line.RunFor(25h);
  EXPECT_EQ(line.CountSent("?A1"), 2U);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
}

TEST(PollerDaily, AnUnansweredPointIsRequestedEveryFiveMinutes) {
  VirtualLine line = OneDaily();
  Swallow(line.twin(0), "?A1", -1);
  line.Open();
  line.RunFor(10h);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_waiting);
  const std::size_t tasks = line.CountSent("?A1") / 3;
  EXPECT_GE(tasks, 110U);
  EXPECT_LE(tasks, 121U);
}

// After the silence to "?A2", replies can be in a wrong order, so the daily value can be that of
// another point.
TEST(PollerDaily, APointIsReadAgainAfterSilence) {
  VirtualLine line = OneDaily();
  line.Open();
  line.RunFor(10s);
  ASSERT_EQ(line.QualityOf(0, 0), Quality::good);
  Swallow(line.twin(0), "?A2", 3);
  line.RunFor(10s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::uncertain);
  line.RunFor(1min);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
  line.RunFor(1h);
  EXPECT_EQ(line.CountSent("?A1"), 2U);
}

/// Device B sends a second reply when `doubled` is set. A refusal by device A before it can have
/// been such a stray reply.
struct Doubled {
  explicit Doubled(config::Device a)
      : line(ToyLine({std::move(a), ToyDevice("b", "B", {"1"})}), {&ToyProtocol()}) {
    line.twin(1).manner.deliver = [this](View, Bytes reply, Instant) {
      std::vector<tools::TimedPiece> said = {{20ms, reply}};
      if (!reply.empty() && std::exchange(doubled, false)) {
        said.push_back({21ms, ToyReply("B1=77")});
      }
      return said;
    };
    line.Open();
  }
  bool Double() {
    doubled = true;
    return line.RunUntil([&] { return line.StatusOf(1).doubled > 0; }, 3s);
  }

  VirtualLine line;
  bool doubled = false;
};

TEST(PollerOnce, AParkedReadIsRequestedAgainWhenTheQueriesChange) {
  config::Device device = ToyDevice("a", "A", {"3", "1"});
  device.points[1].group = config::Group::once;
  device.slow = 5s;
  device.options = ToyOptions();
  device.options.Set("wait", std::int64_t{Duration(2s).count()});
  Doubled at(device);
  bool refused = false;
  bool busy = false;
  at.line.twin(0).manner.instead = [&](View request) -> std::optional<Bytes> {
    if (AsText(request) == "?A3\r" && !std::exchange(refused, true)) return ToyReply("A3~replan");
    if (AsText(request) != "?A1\r") return std::nullopt;
    if (!refused) return Bytes();
    return std::exchange(busy, true) ? std::nullopt : std::optional(ToyReply("A1~busy"));
  };
  ASSERT_TRUE(at.line.RunUntil([&] { return busy; }, 20s));
  ASSERT_TRUE(at.Double());
  at.line.RunFor(10s);
  EXPECT_EQ(at.line.QualityOf(0, 1), Quality::good);
}

TEST(PollerOnce, ARefusedPointIsRequestedAgainAfterASecondReply) {
  config::Device device = ToyDevice("a", "A", {"1", "3"});
  device.points[1].group = config::Group::once;
  Doubled at(device);
  bool refused = false;
  at.line.twin(0).manner.instead = [&](View request) -> std::optional<Bytes> {
    if (AsText(request) == "?A3\r" && !std::exchange(refused, true)) return ToyReply("A3~replan");
    return std::nullopt;
  };
  ASSERT_TRUE(at.line.RunUntil([&] { return refused; }, 5s));
  ASSERT_TRUE(at.Double());
  at.line.RunFor(10s);
  EXPECT_EQ(at.line.QualityOf(0, 1), Quality::good);
}

TEST(Poller, AReplanDropsPointsThatTheDeviceRefuses) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1", "2"})}), {&ToyProtocol()});
  line.twin(0).manner.instead = [](View request) -> std::optional<Bytes> {
    if (AsText(request) != "?A1\r") return std::nullopt;
    return ToyReply("A1~replan");
  };
  line.Open();
  line.RunFor(10s - 1ms);
  EXPECT_EQ(line.CountSent("?A1"), 1U);
  EXPECT_EQ(line.CountSent("?A2"), 10U);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_waiting);
  EXPECT_EQ(line.QualityOf(0, 1), Quality::good);
}

TEST(Poller, AWaitingReadFollowsItsPointsWhenThePlanChanges) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1", "2", "3", "4", "5", "6"})}),
                   {&ToyProtocol()});
  line.Open();
  line.RunFor(2s - 10ms);
  line.twin(0).manner.instead = [](View request) -> std::optional<Bytes> {
    if (AsText(request) != "?A1\r") return std::nullopt;
    return ToyReply("A1~replan");
  };
  std::optional<WriteResult> result;
  WriteCommand command;
  command.kind = Reads{{1, 2, 3, 4, 5}};
  command.deadline = line.now().instant + 1h;
  command.done = [&result](const WriteResult& end) { result = end; };
  line.sent.clear();
  line.Submit(std::move(command));
  ASSERT_TRUE(line.RunUntil([&] { return result.has_value(); }, 800ms));
  EXPECT_EQ(line.CountSent("?A1"), 1U) << "in between";
  EXPECT_TRUE(result->read_back) << result->reason;
}

/// The toy protocol throws if it is asked for a query that does not exist.
TEST(Poller, APollIsNotSentWhenItsProbeRemovedItsQuery) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"}), ToyDevice("b", "B", {"1"})}),
                   {&ToyProtocol()});
  line.twin(0).manner.instead = [](View request) -> std::optional<Bytes> {
    if (AsText(request) != "PA0\r") return std::nullopt;
    return ToyReply("A0~replan");
  };
  line.Open();
  line.RunFor(10s);
  EXPECT_GE(line.CountSent("PA0"), 1U);
  EXPECT_EQ(line.CountSent("?A1"), 0U);
  EXPECT_EQ(line.QualityOf(1, 0), Quality::good);
}

TEST(Poller, SilenceToNeverAnsweredPointsDoesNotPutADeviceOffline) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1", "2", "3", "4", "5"})}), {&ToyProtocol()});
  const std::string_view answered = "?A1\r";
  line.twin(0).manner.deliver = [&](View request, Bytes reply, Instant) {
    const bool silent = AsText(request).starts_with("?A") && AsText(request) != answered;
    return silent ? std::vector<tools::TimedPiece>() : std::vector<tools::TimedPiece>{{5ms, reply}};
  };
  line.Open();
  line.RunFor(60s);
  EXPECT_TRUE(Answers(line.StatusOf(0).state));
  EXPECT_FALSE(IsBad(line.QualityOf(0, 0))) << "it is read all the time";
  line.twin(0).manner.deliver = {};
  line.twin(0).manner.dead = true;
  line.RunFor(60s);
  EXPECT_EQ(line.StatusOf(0).state, DeviceState::offline);
}

TEST(Poller, AReplanAfterAFailureTakesEffect) {
  config::Device device = ToyDevice("a", "A", {"2", "L1"});
  VirtualLine line(ToyLine({device}), {&ToyProtocol()});
  line.twin(0).manner.distort = [](Bytes reply) {
    return AsText(reply).starts_with("!A1") ? Bytes() : reply;
  };
  line.Open();
  line.RunFor(20s - 1ms);
  EXPECT_EQ(line.CountSent("LA1"), 1U) << "given up by the conversation after L and B failed";
  EXPECT_GE(line.CountSent("?A2"), 19U);
  EXPECT_EQ(line.StatusOf(0).last_outcome, Outcome::ok) << "the old plan would ask for nothing";
}

TEST(Poller, APointWithoutARequestNeitherBlocksTheLineNorProvesTheDevice) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"E1"}), ToyDevice("b", "B", {"1"})}),
                   {&ToyProtocol()});
  line.twin(0).manner.dead = true;
  line.Open();
  line.RunFor(10s);
  EXPECT_EQ(line.StatusOf(0).state, DeviceState::never_seen) << "nothing was heard of it";
  EXPECT_EQ(line.StatusOf(0).last_outcome, Outcome::unsupported);
  EXPECT_EQ(line.CountSent("?B1"), 11U);
}

TEST(PollerRetries, AreBoundedAndCounted) {
  config::Line config = ToyLine({ToyDevice("a", "A", {"1"})});
  config.retries = 2;
  VirtualLine line(config, {&ToyProtocol()});
  line.Open();
  line.RunFor(1500ms);
  const std::size_t before = line.CountSent("?A1");
  line.twin(0).manner.dead = true;
  line.RunFor(1400ms);
  EXPECT_EQ(line.CountSent("?A1") - before, 3U) << "one and two retries";
  EXPECT_EQ(line.StatusOf(0).retries, 2U);
  EXPECT_EQ(line.StatusOf(0).Count(Outcome::no_reply), 3U);
}

TEST(PollerRetries, ALostReplyIsRetriedAtOnce) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
  line.Open();
  line.RunFor(1500ms);
  int lost = 1;
  line.twin(0).manner.distort = [&](Bytes reply) { return lost-- > 0 ? Bytes() : reply; };
  const std::uint32_t ok = line.StatusOf(0).Count(Outcome::ok);
  line.RunFor(1s);
  EXPECT_EQ(line.StatusOf(0).Count(Outcome::ok), ok + 1);
  EXPECT_EQ(line.StatusOf(0).retries, 1U);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
}

TEST(PollerRetries, DestructiveReadIsNotRepeated) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"D1"})}), {&ToyProtocol()});
  line.Open();
  line.RunFor(1500ms);
  const std::size_t before = line.CountSent("LA1");
  line.twin(0).manner.dead = true;
  line.RunFor(900ms);
  EXPECT_EQ(line.CountSent("LA1") - before, 1U);
  EXPECT_EQ(line.CountSent("BA"), 0U);
}

TEST(PollerRetries, TheConversationMayReplaceARequestForItsRetry) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"L1"})}), {&ToyProtocol()});
  line.twin(0).values.Set(0, 5.0);
  line.Open();
  line.RunFor(1500ms);
  const std::size_t before = line.CountSent("LA1");
  bool damaged = false;
  line.twin(0).manner.distort = [&](Bytes reply) {
    if (!std::exchange(damaged, true)) reply[1] ^= 0x40U;
    return reply;
  };
  line.twin(0).values.Set(0, 6.0);
  line.RunFor(1s);
  EXPECT_EQ(line.CountSent("LA1") - before, 1U);
  EXPECT_EQ(line.CountSent("BA1"), 2U) << "the first answer may be the late one to L";
  EXPECT_EQ(line.ValueOf(0, 0), Value(6.0)) << "what L destroyed, B repeats";
  EXPECT_EQ(line.StatusOf(0).Count(Outcome::corrupt), 1U);
}

}  // namespace
}  // namespace baudgate::bus
