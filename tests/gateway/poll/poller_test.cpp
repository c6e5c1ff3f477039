// A whole line under virtual time: polls, sessions, plans, dead and returning devices, lost ports.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/poll/poller.h"

#include <gtest/gtest.h>

#include "tests/support/virtual_line.h"

namespace baudgate {
namespace {

config::Device Polled(config::Device device, Duration poll) {
  device.poll = poll;
  return device;
}

/// Says `word` in place of any value.
void Say(VirtualLine::WireTwin& twin, const std::string& word) {
  twin.manner.instead = [word](View request) -> std::optional<Bytes> {
    const std::string_view text = AsText(request);
    if (text[0] != '?') return std::nullopt;
    return ToyReply(std::string(text.substr(1, text.size() - 2)) + "~" + word);
  };
}

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
    if (sent.text == "?A1\r") {
      EXPECT_LE((sent.at - opened) % 1s, 30ms) << "drifts";
    }
  }
  EXPECT_EQ(line.ValueOf(0, 0), Value(1.5));
  EXPECT_EQ(line.ValueOf(0, 1), Value(-2.0));
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
  const DeviceStatus status = line.StatusOf(0);
  EXPECT_EQ(status.state, DeviceState::online);
  EXPECT_GE(status.exchanges, 20U);
  EXPECT_LE(status.exchanges, 22U) << "20 polls, and the probe that goes first";
  EXPECT_EQ(status.Count(Outcome::ok), status.exchanges);
  EXPECT_EQ(status.missed, 0U);
  EXPECT_GT(status.round_trips.mean(), 10ms) << "4 + 9 characters at 9600 bit/s and 5 ms to think";
  EXPECT_LT(status.round_trips.mean(), 30ms);
}

TEST(Poller, NothingIsOnlineBehindAClosedPort) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
  line.Open();
  line.RunFor(3s);
  ASSERT_EQ(line.StatusOf(0).state, DeviceState::online);
  line.Close();
  EXPECT_EQ(line.StatusOf(0).state, DeviceState::offline);
  EXPECT_EQ(line.StatusOf(0).last_outcome, Outcome::line_down);
  line.Open();
  line.RunFor(3s);
  EXPECT_EQ(line.StatusOf(0).state, DeviceState::online);
}

TEST(Poller, AnOutageDoesNotMakeOldValuesLookYounger) {
  VirtualLine line(ToyLine({Polled(ToyDevice("a", "A", {"1", "2", "3"}), 1s)}), {&ToyProtocol()});
  line.Open();
  line.RunFor(5s);
  Quality best_when_old = Quality::bad;
  line.always = [&] {
    const auto age = line.AgeOf(0, 0);
    if (age && *age > 9s &&
        static_cast<int>(line.QualityOf(0, 0)) > static_cast<int>(best_when_old)) {
      best_when_old = line.QualityOf(0, 0);
    }
  };
  line.twin(0).manner.dead = true;
  line.RunFor(15s);
  line.twin(0).manner.dead = false;
  line.RunFor(10s);
  EXPECT_TRUE(IsBad(best_when_old)) << "beyond dead_age of 9 s";
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
}

TEST(Poller, AnyFragmentationGivesTheSame) {
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

TEST(Poller, QualitiesAlongALife) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_not_connected) << "the port is not open yet";
  line.twin(0).manner.dead = true;
  line.Open();
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_waiting);
  line.RunFor(100ms);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_waiting);
  line.RunFor(10s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_communication) << "offline stands before never read";
  line.twin(0).manner.dead = false;
  line.RunFor(3s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
  line.twin(0).manner.dead = true;
  EXPECT_TRUE(line.RunUntil([&] { return line.QualityOf(0, 0) != Quality::good; }, 10s));
  line.RunFor(10s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_communication);
  line.Close();
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_not_connected);
  EXPECT_EQ(line.StatusOf(0).last_outcome, Outcome::line_down);
  line.twin(0).manner.dead = false;
  line.Open();
  EXPECT_NE(line.QualityOf(0, 0), Quality::good) << "not before it has been read again";
  line.RunFor(3s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
}

TEST(Poller, DisabledDeviceIsLeftAlone) {
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

TEST(Poller, TroubleThatTheDeviceReportsIsNeverANumber) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
  line.twin(0).values.Set(0, 3.0);
  line.Open();
  line.RunFor(1500ms);
  ASSERT_EQ(line.QualityOf(0, 0), Quality::good);
  Say(line.twin(0), "fault");
  line.RunFor(1s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_sensor_failure);
  Say(line.twin(0), "nan");
  line.RunFor(1s);
  EXPECT_TRUE(IsBad(line.QualityOf(0, 0)));
  EXPECT_EQ(line.ValueOf(0, 0), Value(3.0)) << "the last good one";
  EXPECT_EQ(line.StatusOf(0).state, DeviceState::online) << "a bad channel is no bad device";
}

TEST(Poller, BusyParksTheQueryAndResumesIt) {
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

TEST(Poller, ADeviceThatIsBusyForEverStaysOnlineAndIsNotHammered) {
  config::Line config = ToyLine({ToyDevice("a", "A", {"1", "2"})});
  config.retries = 20;
  VirtualLine line(config, {&ToyProtocol()});
  Say(line.twin(0), "busy");
  line.Open();
  line.RunFor(60s);
  EXPECT_EQ(line.StatusOf(0).state, DeviceState::online);
  EXPECT_EQ(line.StatusOf(0).Count(Outcome::busy), line.StatusOf(0).exchanges - 1) << "the probe";
  EXPECT_LE(line.sent.size(), 60s / 50ms) << "the pause that it asked for is kept";
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_waiting);
}

TEST(Poller, SessionIsOpenedFirstAndAgainAfterTheDeviceForgotIt) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"S1"})}), {&ToyProtocol()});
  line.twin(0).values.Set(0, 8.0);
  line.Open();
  line.RunFor(2500ms);
  EXPECT_EQ(line.CountSent("OA"), 1U);
  EXPECT_EQ(line.CountSent("?A1"), 3U);
  bool closed = true;
  line.twin(0).manner.instead = [&](View request) -> std::optional<Bytes> {
    if (request[0] != '?' || !std::exchange(closed, false)) return std::nullopt;
    return ToyReply("A1~closed");
  };
  line.RunFor(1s);
  EXPECT_EQ(line.CountSent("OA"), 2U);
  EXPECT_EQ(line.CountSent("?A1"), 5U) << "within the same period";
  EXPECT_EQ(line.ValueOf(0, 0), Value(8.0));
}

TEST(Poller, AConversationThatGoesRoundInCirclesIsEnded) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"S1"}), ToyDevice("b", "B", {"1"})}),
                   {&ToyProtocol()});
  line.Open();
  line.RunFor(1500ms);
  Say(line.twin(0), "closed");
  const std::size_t before = line.CountSent("?A1") + line.CountSent("OA");
  line.RunFor(1s);
  EXPECT_LE(line.CountSent("?A1") + line.CountSent("OA") - before, 8U) << "8 steps make a task";
  EXPECT_EQ(line.QualityOf(1, 0), Quality::good);
}

TEST(Poller, ReplanDropsWhatTheDeviceDoesNotKnow) {
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

/// The toy throws when it is asked for a query that it does not have.
TEST(Poller, APollWhoseQueryWentWithTheProbeBeforeItIsNotAsked) {
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

TEST(Poller, ReplanAfterAFailureIsHeard) {
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

TEST(Poller, APointThatCanNotBeAskedHarmsNobodyAndProvesNothing) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"E1"}), ToyDevice("b", "B", {"1"})}),
                   {&ToyProtocol()});
  line.twin(0).manner.dead = true;
  line.Open();
  line.RunFor(10s);
  EXPECT_EQ(line.StatusOf(0).state, DeviceState::never_seen) << "nothing was heard of it";
  EXPECT_EQ(line.StatusOf(0).last_outcome, Outcome::unsupported);
  EXPECT_EQ(line.CountSent("?B1"), 11U);
}

TEST(Poller, ReturnIsPolledAtOnce) {
  config::Device device = ToyDevice("a", "A", {"1"});
  device.points[0].group = config::Group::slow;
  device.slow = 1h;
  device.points.push_back(ToyDevice("", "", {"2"}).points[0]);
  VirtualLine line(ToyLine({device}), {&ToyProtocol()});
  line.twin(0).manner.dead = true;
  line.Open();
  line.RunFor(1min);
  ASSERT_EQ(line.StatusOf(0).state, DeviceState::offline);
  line.twin(0).manner.dead = false;
  ASSERT_TRUE(line.RunUntil([&] { return line.twin(0).answered == 1; }, 2s))
      << "probed on an idle line";
  line.RunFor(1200ms);  // the ceiling of an exchange: the probes before might still be answered
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good) << "the slow group as well";
  EXPECT_EQ(line.QualityOf(0, 1), Quality::good);
  ASSERT_FALSE(line.states.empty());
  EXPECT_EQ(line.states.back().to, DeviceState::online);
}

TEST(Poller, ADeadDeviceCostsTheLivingNextToNothing) {
  const auto answered_in_a_minute = [](bool dead_neighbours) {
    std::vector<config::Device> devices = {Polled(ToyDevice("a", "A", {"1", "2"}), 50ms)};
    for (const char* name : {"b", "c", "d"}) {
      devices.push_back(Polled(ToyDevice(name, std::string(1, char(name[0] - 32)), {"1"}), 50ms));
    }
    VirtualLine line(ToyLine(devices), {&ToyProtocol()});
    if (!dead_neighbours) {
      VirtualLine alone(ToyLine({devices[0]}), {&ToyProtocol()});
      alone.Open();
      alone.RunFor(60s);
      return alone.twin(0).answered;
    }
    for (std::size_t i = 1; i < 4; ++i) line.twin(i).manner.dead = true;
    line.Open();
    line.RunFor(60s);
    return line.twin(0).answered;
  };
  const std::size_t alone = answered_in_a_minute(false);
  const std::size_t among_dead = answered_in_a_minute(true);
  EXPECT_GE(among_dead * 100, alone * 95) << among_dead << " of " << alone;
}

TEST(Poller, AReturnIsNoticedOnALineThatIsNeverIdle) {
  VirtualLine line(ToyLine({Polled(ToyDevice("a", "A", {"1", "2", "3"}), 10ms),
                            Polled(ToyDevice("b", "B", {"1"}), 10ms)}),
                   {&ToyProtocol()});
  line.twin(1).manner.dead = true;
  line.Open();
  line.RunFor(60s);
  ASSERT_EQ(line.StatusOf(1).state, DeviceState::offline);
  line.twin(1).manner.dead = false;
  EXPECT_TRUE(line.RunUntil([&] { return line.QualityOf(1, 0) == Quality::good; }, 30s));
}

TEST(Poller, ADeviceThatAsksForPeaceInItsProbeIsLeftInPeace) {
  config::Device device = ToyDevice("a", "A", {"1"});
  device.options.Set("wait", std::int64_t{Duration(5min).count()});
  VirtualLine line(ToyLine({device}), {&ToyProtocol()});
  line.twin(0).manner.instead = [](View) -> std::optional<Bytes> { return ToyReply("A0~busy"); };
  line.Open();
  line.RunFor(4min);
  EXPECT_EQ(line.sent.size(), 1U);
}

TEST(Poller, NeverSeenDeviceIsProbedOnly) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1", "2", "3"})}), {&ToyProtocol()});
  line.twin(0).manner.dead = true;
  line.Open();
  line.RunFor(60s);
  EXPECT_EQ(line.CountSent("?A"), 0U);
  EXPECT_GT(line.CountSent("PA0"), 20U);
  EXPECT_EQ(line.StatusOf(0).retries, 0U);
}

TEST(Poller, OfflineByCountAndByTime) {
  VirtualLine line(ToyLine({Polled(ToyDevice("a", "A", {"1"}), 100ms)}), {&ToyProtocol()});
  line.Open();
  line.RunFor(1s);
  const Instant died = line.now().instant;
  line.twin(0).manner.dead = true;
  ASSERT_TRUE(line.RunUntil([&] { return line.StatusOf(0).state == DeviceState::offline; }, 30s));
  EXPECT_GE(line.now().instant - died, DeviceHealth::kOfflineTime);
  EXPECT_EQ(line.states[1].to, DeviceState::degraded) << "one change after the other";
  EXPECT_EQ(line.states.back().to, DeviceState::offline);
}

// A meter that is busy asks for 15 s of peace, twice: none of that is the line's.
TEST(Poller, WaitingMakesNoValueLastLonger) {
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
      EXPECT_EQ(record.age_limits[static_cast<std::size_t>(config::Group::fast)].max_age, 3s);
    });
  };
  line.RunFor(1min);
  EXPECT_LT(busy, 0);
}

TEST(Poller, MissedPeriodsAreCounted) {
  VirtualLine line(ToyLine({Polled(ToyDevice("a", "A", {"1", "2", "3", "4"}), 40ms)}),
                   {&ToyProtocol()});
  line.Open();
  line.RunFor(10s);
  EXPECT_GT(line.StatusOf(0).missed, 50U);
  EXPECT_EQ(line.QualityOf(0, 3), Quality::good) << "max_age follows the measured cycle";
}

/// The port goes away at every millisecond of a second's work, in whatever state that is.
TEST(Poller, PortLostAtAnyMomentAndReopened) {
  for (Duration lost = 0ms; lost < 700ms; lost += 7ms) {
    config::Device slow = ToyDevice("c", "C", {"1"});
    VirtualLine line(ToyLine({ToyDevice("a", "A", {"1", "S2"}), ToyDevice("b", "B", {"L1"}), slow}),
                     {&ToyProtocol()});
    line.twin(1).manner.dead = true;
    Say(line.twin(2), "busy");
    line.Open();
    line.RunFor(2s);
    line.Write(0, 0, 5.0);
    line.RunFor(lost);
    line.Close();
    EXPECT_FALSE(line.poller().Deadline());
    EXPECT_EQ(line.outcomes.size(), 1U) << "answered exactly once, at the latest now";
    EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_not_connected);
    const std::size_t sent = line.sent.size();
    line.RunFor(10s);
    EXPECT_EQ(line.sent.size(), sent) << "nothing is sent into a closed port";
    line.Open();
    line.RunFor(2s);
    EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
    EXPECT_EQ(line.QualityOf(0, 1), Quality::good);
    EXPECT_EQ(line.outcomes.size(), 1U);
  }
}

TEST(Poller, OpeningTwiceIsOpeningAnew) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
  line.Open();
  line.RunFor(3ms);
  line.Open();
  line.RunFor(5s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
}

TEST(Poller, ALineWithoutDevicesIsIdleForEver) {
  VirtualLine line(ToyLine({}), {&ToyProtocol()});
  line.Open();
  line.Inject(ToBytes("noise"), 1s);
  line.RunFor(1min);
  EXPECT_FALSE(line.poller().Deadline());
  EXPECT_EQ(line.poller().ledger().counters().stray_bytes, 5U);
}

TEST(Poller, SilenceOfTheWholeLineShows) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
  line.Open();
  line.RunFor(10s);
  EXPECT_FALSE(line.poller().ledger().SilentSince(line.now().instant - 2s));
  line.twin(0).manner.dead = true;
  line.RunFor(30s);
  EXPECT_TRUE(line.poller().ledger().SilentSince(line.now().instant - 20s));
}

}  // namespace
}  // namespace baudgate
