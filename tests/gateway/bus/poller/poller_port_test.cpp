// Tests of a port that closes and opens, of sessions (points that need a login), and of the status,
// under virtual time.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <utility>

#include "gateway/bus/poller/poller.h"
#include "tests/gateway/bus/poller/poller_fixture.h"
#include "tests/support/virtual_line.h"

namespace baudgate::bus {
namespace {

TEST(Poller, DevicesAreOfflineWhileThePortIsClosed) {
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

TEST(Poller, PollingResumesAfterThePortIsLostAtAnyTime) {
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
    EXPECT_EQ(line.ends.size(), 1U) << "answered exactly once, at the latest now";
    EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_not_connected);
    const std::size_t sent = line.sent.size();
    line.RunFor(10s);
    EXPECT_EQ(line.sent.size(), sent) << "nothing is sent into a closed port";
    line.Open();
    line.RunFor(2s);
    EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
    EXPECT_EQ(line.QualityOf(0, 1), Quality::good);
    EXPECT_EQ(line.ends.size(), 1U);
  }
}

struct EndTap : Tap {
  void OnSent(std::uint32_t, const protocols::Request&, Now) override { ++sent; }
  void OnReceived(View, Now) override {}
  void OnExchangeEnd(std::uint32_t, const ExchangeEnd& end, Now) override { ends.push_back(end); }
  void OnDeviceState(std::uint32_t, DeviceState, const std::string&, Now) override {}
  std::size_t sent = 0;
  std::vector<ExchangeEnd> ends;
};

TEST(Poller, AnExchangeCutOffByAClosedPortIsCountedAndEnds) {
  for (Duration lost = 0ms; lost < 1s; lost += 7ms) {
    SCOPED_TRACE(FormatDuration(lost));
    VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
    EndTap tap;
    line.poller().Attach(tap);
    line.Open();
    line.RunFor(2s + lost);
    const bool cut_off = line.asking();
    line.Close();
    EXPECT_EQ(tap.ends.size(), tap.sent);
    EXPECT_EQ(tap.ends.back().outcome == Outcome::line_down, cut_off);
    const LineCounters& counters = line.poller().accounts().line.counters();
    EXPECT_EQ(counters.exchanges, tap.sent);
    EXPECT_EQ(counters.Count(Outcome::line_down), cut_off ? 1U : 0U);
    EXPECT_EQ(line.StatusOf(0).Count(Outcome::line_down), cut_off ? 1U : 0U);
    EXPECT_EQ(line.StatusOf(0).recent.Count(Outcome::line_down), 0U) << "it says nothing of a";
  }
}

TEST(Poller, MessagesOfAnotherProtocolAreDetected) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
  EndTap tap;
  line.poller().Attach(tap, {[](View heard) -> std::optional<std::string> {
                         if (AsText(heard).find("@@@@") == std::string_view::npos) return {};
                         return "messages of another protocol come";
                       }});
  line.Open();
  line.RunFor(2500ms);
  line.Inject(ToBytes("@@@@"));
  line.RunFor(1s);
  EXPECT_EQ(line.StatusOf(0).findings.Count(Symptom::master_beside), 1U);
}

TEST(Poller, UnsentBytesOfAnUnansweredRequestAreDropped) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
  line.Open();
  line.RunFor(2500ms);
  EXPECT_EQ(line.dropped, 0U);
  line.twin(0).manner.dead = true;
  line.RunFor(1s);
  const std::size_t failed =
      line.poller().accounts().line.counters().outcomes[static_cast<std::size_t>(
          Outcome::no_reply)];
  EXPECT_GT(failed, 0U);
  EXPECT_EQ(line.dropped, failed);
  line.Close();
  EXPECT_EQ(line.dropped, failed) << "a closed port has nothing to drop";
}

TEST(Poller, OpeningThePortTwiceRestartsPolling) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
  line.Open();
  line.RunFor(3ms);
  line.Open();
  line.RunFor(5s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
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

TEST(Poller, ADeviceThatAnswersAfterALostRequestIsIdentifiedAgain) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"S1", "2"})}), {&ToyProtocol()});
  line.twin(0).values.Set(0, 1001.0);
  line.twin(0).values.Set(1, 1002.0);
  line.Open();
  line.RunFor(2500ms);
  ASSERT_EQ(line.QualityOf(0, 1), Quality::good);
  bool closed = true;
  bool other = false;
  line.twin(0).manner.instead = [&](View request) -> std::optional<Bytes> {
    if (request[0] == '?' && std::exchange(closed, false)) return ToyReply("A1~closed");
    if (request[0] == 'O' && !std::exchange(other, true)) {
      line.twin(0).values.Set(0, 2001.0);
      line.twin(0).values.Set(1, 2002.0);
      return Bytes();
    }
    return request[0] == 'P' && other ? std::optional(ToyReply("A0=9")) : std::nullopt;
  };
  line.always = [&] {
    const bool both =
        line.QualityOf(0, 0) == Quality::good && line.QualityOf(0, 1) == Quality::good;
    if (both && line.ValueOf(0, 0) == Value(2001.0)) {
      EXPECT_EQ(line.ValueOf(0, 1), Value(2002.0));
    }
  };
  line.RunFor(3s);
  EXPECT_TRUE(other);
  EXPECT_EQ(line.ValueOf(0, 0), Value(2001.0));
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
}

TEST(Poller, AConversationThatLoopsIsEnded) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"S1"}), ToyDevice("b", "B", {"1"})}),
                   {&ToyProtocol()});
  line.Open();
  line.RunFor(1500ms);
  Say(line.twin(0), "closed");
  const std::size_t before = line.CountSent("?A1") + line.CountSent("OA");
  line.RunFor(1s);
  EXPECT_LE(line.CountSent("?A1") + line.CountSent("OA") - before, 10U) << "10 steps make a task";
  EXPECT_EQ(line.QualityOf(1, 0), Quality::good);
}

TEST(Poller, ATaskContinuesAfterItsBroadcast) {
  std::size_t proofs[2] = {};
  for (const std::string read : {"1", "N1"}) {
    VirtualLine line(ToyLine({ToyDevice("a", "A", {read}), ToyDevice("b", "B", {"U1"})}),
                     {&ToyProtocol()});
    line.twin(0).values.Set(0, 8.0);
    line.Open();
    line.RunFor(3500ms);
    const bool announced = read == "N1";
    EXPECT_EQ(line.CountSent("QA1"), announced ? 5U : 0U) << "the first task begins anew";
    EXPECT_EQ(line.CountSent("?A1"), 4U);
    EXPECT_EQ(line.ValueOf(0, 0), Value(8.0));
    EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
    EXPECT_EQ(line.QualityOf(1, 0), Quality::good);
    EXPECT_EQ(line.StatusOf(0).retries, 0U);
    proofs[announced ? 1 : 0] = line.CountSent("P");
  }
  EXPECT_EQ(proofs[0], proofs[1]) << "nothing is owed to a broadcast";
}

TEST(Poller, ABroadcastIsNoProofBeforeTheFirstRead) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"N1"})}), {&ToyProtocol()});
  line.Open();
  line.RunFor(500ms);
  ASSERT_GE(line.sent.size(), 4U);
  EXPECT_EQ(line.sent[0].text.substr(0, 1), "Q");
  EXPECT_EQ(line.sent[1].text.substr(0, 1), "P") << "the read is the first that is answered";
  EXPECT_EQ(line.sent[line.sent.size() - 2].text.substr(0, 1), "Q");
  EXPECT_EQ(line.sent.back().text.substr(0, 3), "?A1");
  EXPECT_EQ(line.CountSent("?A1"), 1U);
}

TEST(Poller, ADeviceWithABroadcastTaskReturnsAfterAnAbsence) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"N1"})}), {&ToyProtocol()});
  line.Open();
  line.RunFor(1500ms);
  line.twin(0).manner.dead = true;
  line.RunFor(1min);
  EXPECT_EQ(line.StatusOf(0).state, DeviceState::offline);
  line.twin(0).manner.dead = false;
  line.RunFor(1min);
  EXPECT_EQ(line.StatusOf(0).state, DeviceState::online);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
}

config::Line TwoDevices() {
  return ToyLine({ToyDevice("a", "A", {"1"}), ToyDevice("b", "B", {"1"})});
}

TEST(LineStatusTest, CountsTheSumOfItsDevices) {
  VirtualLine line(TwoDevices(), {&ToyProtocol()});
  line.Open();
  line.RunFor(5s);
  line.twin(1).manner.dead = true;
  line.RunFor(20s);
  const LineStatus status = line.store().ReadLine(0);
  const DeviceStatus a = line.StatusOf(0);
  const DeviceStatus b = line.StatusOf(1);
  EXPECT_EQ(status.exchanges, a.exchanges + b.exchanges);
  EXPECT_EQ(status.Count(Outcome::ok), a.Count(Outcome::ok) + b.Count(Outcome::ok));
  EXPECT_EQ(status.Count(Outcome::no_reply), b.Count(Outcome::no_reply));
  EXPECT_EQ(status.round_trips.count(), status.Count(Outcome::ok));
  EXPECT_GT(status.probes, 0U);
  EXPECT_LT(status.probes, b.exchanges);
  EXPECT_GT(status.bytes_out, 0U);
  EXPECT_EQ(status.late, 0U);
}

TEST(FastPoll, APeriodOfFiveMillisecondsIsMetWhenTheLineHasTime) {
  config::Line config = ToyLine({ToyDevice("a", "A", {"1", "2"})});
  config.serial.baud = 921'600;
  config.timing.quiet = 100us;
  config.devices[0].poll = 5ms;
  config.devices[0].points[1].poll = 500ms;
  config.devices[0].points[1].group = config::Group::own;
  config.devices[0].intervals = {500ms};
  VirtualLine line(config, {&ToyProtocol()});
  line.twin(0).manner.think = 1ms;
  line.Open();
  line.RunFor(1s);
  const DeviceStatus before = line.StatusOf(0);
  line.RunFor(10s);
  const DeviceStatus after = line.StatusOf(0);
  EXPECT_NEAR(static_cast<double>(after.Count(Outcome::ok) - before.Count(Outcome::ok)), 2020, 3);
  EXPECT_EQ(after.missed, before.missed);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
  EXPECT_EQ(line.QualityOf(0, 1), Quality::good) << "it ages by its own interval";
  line.twin(0).manner.think = 12ms;
  line.RunFor(10s);
  const DeviceStatus slow = line.StatusOf(0);
  const auto asked = slow.Count(Outcome::ok) - after.Count(Outcome::ok);
  const auto missed = slow.missed - after.missed;
  EXPECT_NEAR(static_cast<double>(asked + missed), 2020, 20) << asked << " and " << missed;
  EXPECT_GT(missed, 1000U);
}

TEST(LineStatusTest, UseIsThePartOfAMinuteThatTheLineWasBusy) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
  line.twin(0).manner.think = 90ms;
  line.Open();
  line.RunFor(5s);
  EXPECT_EQ(line.store().ReadLine(0).use, 0) << "too short to tell";
  line.RunFor(25s);
  EXPECT_NEAR(line.store().ReadLine(0).use, 0.11, 0.02) << "of the first half minute";
  line.RunFor(95s);
  EXPECT_NEAR(line.store().ReadLine(0).use, 0.11, 0.02);
  line.Close();
  EXPECT_EQ(line.store().ReadLine(0).use, 0);
}

TEST(LateReplies, AreCountedOncePerExchangeWithTheirLateness) {
  config::Line config = ToyLine({ToyDevice("a", "A", {"1"})});
  config.timing.reply = 100ms;
  config.retries = 0;
  VirtualLine line(config, {&ToyProtocol()});
  line.Open();
  line.RunFor(1500ms);
  line.twin(0).manner.think = 150ms;
  line.twin(0).manner.fragment = 1;
  line.RunFor(1s);
  EXPECT_EQ(line.StatusOf(0).late, 1U);
  EXPECT_EQ(line.store().ReadLine(0).late, 1U);
  EXPECT_GE(line.StatusOf(0).lateness, 50ms);
  EXPECT_LE(line.StatusOf(0).lateness, 60ms);
}

TEST(BabbleTest, BabbleAfterADamagedReplyIsNotALateReply) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
  line.twin(0).manner.babble = 5s;
  line.Open();
  line.RunFor(20s);
  EXPECT_GT(line.StatusOf(0).Count(Outcome::corrupt), 0U);
  EXPECT_EQ(line.StatusOf(0).late, 0U);
  EXPECT_TRUE(line.StatusOf(0).failures.runs().empty()) << "nor an outage";
}

TEST(InUse, ADeviceTakenOutIsNotAskedAndItsPointsAreOutOfService) {
  VirtualLine line(TwoDevices(), {&ToyProtocol()});
  line.Open();
  line.RunFor(5s);
  line.poller().SetInUse(0, false, line.now());
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_out_of_service);
  EXPECT_EQ(line.StatusOf(0).state, DeviceState::disabled);
  const std::size_t asked = line.CountSent("?A");
  line.Write(0, 0, 7.0);
  line.RunFor(10s);
  EXPECT_EQ(line.CountSent("?A"), asked);
  EXPECT_EQ(line.CountSent("W"), 0U);
  EXPECT_EQ(line.ends, std::vector<WriteEnd>{WriteEnd::not_sent});
  EXPECT_EQ(line.QualityOf(1, 0), Quality::good);
}

TEST(InUse, TheStatusNamesWhoHasDisabledADevice) {
  VirtualLine line(TwoDevices(), {&ToyProtocol()});
  line.Open();
  line.RunFor(5s);
  line.poller().SetInUse(0, false, line.now(), "user:anna");
  EXPECT_EQ(line.StatusOf(0).disabled_by, "user:anna");
  EXPECT_EQ(line.StatusOf(0).disabled_since, line.now().wall);
  line.poller().SetInUse(0, true, line.now(), "user:bert");
  EXPECT_EQ(line.StatusOf(0).disabled_by, "");
}

TEST(InUse, ADeviceTakenBackIsPolledAtOnce) {
  VirtualLine line(TwoDevices(), {&ToyProtocol()});
  line.Open();
  line.RunFor(5s);
  line.poller().SetInUse(0, false, line.now());
  line.RunFor(10min);
  line.poller().SetInUse(0, true, line.now());
  EXPECT_TRUE(line.RunUntil([&] { return line.QualityOf(0, 0) == Quality::good; }, 1s));
  EXPECT_EQ(line.StatusOf(0).state, DeviceState::online);
}

TEST(InUse, ADeviceTakenOutStaysOutAfterALostPort) {
  VirtualLine line(TwoDevices(), {&ToyProtocol()});
  line.Open();
  line.RunFor(5s);
  line.poller().SetInUse(0, false, line.now());
  line.Close();
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_out_of_service);
  EXPECT_EQ(line.QualityOf(1, 0), Quality::bad_not_connected);
  line.Open();
  const std::size_t asked = line.CountSent("?A");
  line.RunFor(10s);
  EXPECT_EQ(line.CountSent("?A"), asked);
  EXPECT_EQ(line.StatusOf(0).state, DeviceState::disabled);
}

TEST(DeviceStatusOfLine, CountsLineTimeAndRecentOutcomes) {
  VirtualLine line(TwoDevices(), {&ToyProtocol()});
  line.Open();
  line.RunFor(5s);
  const Duration before = line.StatusOf(0).busy;
  EXPECT_GT(before, 0ms);
  line.twin(0).manner.dead = true;
  line.twin(1).manner.copies = 2;
  line.RunFor(3s);
  EXPECT_GT(line.StatusOf(0).busy - before, 500ms);
  EXPECT_LT(line.StatusOf(1).busy, 1s);
  EXPECT_EQ(line.StatusOf(1).doubled, 0U);
  EXPECT_GT(line.StatusOf(0).recent.Count(Outcome::no_reply), 0U);
  line.RunFor(1min);
  ASSERT_EQ(line.StatusOf(0).state, DeviceState::offline);
  line.twin(0).manner.dead = false;
  line.RunFor(20s);
  EXPECT_EQ(line.StatusOf(0).recent.Count(Outcome::no_reply), 0U) << "that was the outage";
  EXPECT_GT(line.StatusOf(0).recent.Count(Outcome::ok), 10U);
}

TEST(InUse, ADeviceTakenOutDoesNotLengthenTheMaxAgeOfOthers) {
  config::Line settings = TwoDevices();
  settings.devices[0].poll = 100ms;
  settings.devices[1].poll = 10s;
  VirtualLine line(settings, {&ToyProtocol()});
  line.twin(1).manner.think = 190ms;
  line.Open();
  line.RunFor(15s);
  const auto max_age = [&] {
    Duration age{};
    line.store().Read(0, [&](const DeviceRecord& record) {
      age = record.age_limits[static_cast<std::size_t>(config::Group::fast)].uncertain_after;
    });
    return age;
  };
  EXPECT_GT(max_age(), 300ms);
  line.poller().SetInUse(1, false, line.now());
  EXPECT_EQ(max_age(), 300ms);
}

TEST(InUse, ADeviceTakenIntoUseStaysOfflineWhileThePortIsClosed) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
  line.Open();
  line.RunFor(5s);
  line.Close();
  line.poller().SetInUse(0, false, line.now());
  line.poller().SetInUse(0, true, line.now());
  EXPECT_EQ(line.StatusOf(0).state, DeviceState::offline);
  line.Open();
  line.RunFor(5s);
  EXPECT_EQ(line.StatusOf(0).state, DeviceState::online);
}

TEST(InUse, ADeviceThatIsDisabledInTheFileCanBeTakenIntoUse) {
  config::Line config = TwoDevices();
  config.devices[0].enabled = false;
  VirtualLine line(config, {&ToyProtocol()});
  line.Open();
  line.RunFor(5s);
  EXPECT_EQ(line.CountSent("?A"), 0U);
  EXPECT_EQ(line.StatusOf(0).state, DeviceState::disabled);
  line.poller().SetInUse(0, true, line.now());
  EXPECT_TRUE(line.RunUntil([&] { return line.QualityOf(0, 0) == Quality::good; }, 1s));
}

TEST(InUse, ADeviceTakenOutDuringItsExchangeIsDisabled) {
  VirtualLine line(TwoDevices(), {&ToyProtocol()});
  line.Open();
  line.RunFor(5s);
  ASSERT_TRUE(line.RunUntil(
      [&] { return !line.sent.empty() && line.sent.back().text[1] == 'A' && line.asking(); }, 2s));
  line.poller().SetInUse(0, false, line.now());
  line.RunFor(10s);
  EXPECT_EQ(line.StatusOf(0).state, DeviceState::disabled);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_out_of_service);
  EXPECT_EQ(line.QualityOf(1, 0), Quality::good);
}

TEST(InUse, ADeviceTakenOutIsNotPolledAfterAReplanOrABusyReply) {
  for (const char* word : {"replan", "busy"}) {
    VirtualLine line(TwoDevices(), {&ToyProtocol()});
    line.Open();
    line.RunFor(5s);
    line.twin(0).manner.instead = [&](View request) -> std::optional<Bytes> {
      if (request[0] != '?') return std::nullopt;
      return ToyReply(std::string("A1~") + word);
    };
    const std::size_t before = line.CountSent("?A");
    ASSERT_TRUE(line.RunUntil([&] { return line.CountSent("?A") > before; }, 2s));
    line.poller().SetInUse(0, false, line.now());
    const std::size_t asked = line.CountSent("?A") + line.CountSent("PA");
    line.RunFor(10s);
    EXPECT_EQ(line.CountSent("?A") + line.CountSent("PA"), asked) << word;
  }
}

TEST(Released, PointsOfALentPortAreOutOfService) {
  VirtualLine line(TwoDevices(), {&ToyProtocol()});
  line.Open();
  line.RunFor(5s);
  line.Write(0, 0, 7.0);
  line.poller().OnClosed(line.now(), Quality::bad_out_of_service);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_out_of_service);
  EXPECT_EQ(line.StatusOf(0).last_outcome, Outcome::line_down);
  EXPECT_EQ(line.ends, std::vector<WriteEnd>{WriteEnd::not_sent});
  line.RunFor(1min);
  line.Open();
  EXPECT_TRUE(line.RunUntil([&] { return line.QualityOf(0, 0) == Quality::good; }, 2s));
}

}  // namespace
}  // namespace baudgate::bus
