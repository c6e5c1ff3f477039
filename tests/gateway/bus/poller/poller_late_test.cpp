// Answers that come late, under virtual time: never taken for others, and the user is told.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/bus/poller/poller.h"
#include "tests/gateway/bus/poller/truth.h"

namespace baudgate {
namespace {

/// Replies without any tag (as DCON's), and a device that is too slow by anything up to the ceiling
/// of an exchange: an answer to one query may never be stored as that of another.
TEST(PollerLate, LateAnswersAreNeverTakenForOthers) {
  for (Duration think = 5ms; think < 900ms; think += 11ms) {
    VirtualLine line(ToyLine({ToyDevice("a", "A", {"U1", "U2", "U3"})}), {&ToyProtocol()});
    SetTruth(line, 1, 3);
    line.always = [&] { ExpectOnlyTruth(line, 1, 3); };
    line.Open();
    line.RunFor(3s);  // in time
    line.twin(0).manner.think = think;
    line.RunFor(30s);
    if (::testing::Test::HasFatalFailure()) FAIL() << "think time " << FormatDuration(think);
  }
}

TEST(PollerLate, AnAnswerIsNotTakenForThatOfAnotherDevice) {
  for (Duration think = 5ms; think < 900ms; think += 11ms) {
    VirtualLine line(
        ToyLine({ToyDevice("a", "A", {"U1", "U2"}), ToyDevice("b", "B", {"U1", "U2"})}),
        {&ToyProtocol()});
    SetTruth(line, 2, 2);
    line.always = [&] { ExpectOnlyTruth(line, 2, 2); };
    line.Open();
    line.RunFor(3s);
    line.twin(0).manner.think = think;
    line.RunFor(30s);
    if (::testing::Test::HasFatalFailure()) FAIL() << "think time " << FormatDuration(think);
    EXPECT_TRUE(line.RunUntil([&] { return line.QualityOf(1, 1) == Quality::good; }, 5s))
        << "think time " << FormatDuration(think);
  }
}

/// The late answer to the first try is taken for that to its retry: the same value, but the user
/// has to know that the device is slower than its setting.
TEST(PollerLate, IsFoundOutThoughItMeetsTheRetry) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
  line.Open();
  line.RunFor(1500ms);
  line.twin(0).manner.think = 300ms;  // reply time 200 ms, drain 50 ms
  line.RunFor(1500ms);
  const DeviceStatus status = line.StatusOf(0);
  EXPECT_GT(status.late, 0U);
  EXPECT_GE(status.lateness, 90ms);
  EXPECT_LE(status.lateness, 150ms);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
}

/// The program was stopped while the reply waited in the system: it may have come at any time.
TEST(PollerLate, AReplyThatWaitedThroughAStopIsAsOldAsTheStop) {
  for (const bool timers_first : {false, true}) {
    VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
    line.Open();
    line.RunFor(1500ms);
    ASSERT_TRUE(line.RunUntil([&] { return line.asking(); }, 2s));
    line.Stop(250ms, timers_first);
    EXPECT_GE(line.AgeOf(0, 0), 240ms);
    line.RunFor(2s);
    ASSERT_TRUE(line.RunUntil([&] { return line.AgeOf(0, 0) < 20ms; }, 2s)) << "as ever";
  }
}

/// Replies carry a name, so the line asks b meanwhile, and the reply of a meets that exchange.
TEST(PollerLate, AReplyThatMeetsTheExchangeOfAnotherDeviceIsCounted) {
  config::Device a = ToyDevice("a", "A", {"1"});
  a.retries = 0;
  VirtualLine line(ToyLine({a, ToyDevice("b", "B", {"1"})}), {&ToyProtocol()});
  line.Open();
  line.RunFor(1500ms);
  line.twin(0).manner.think = 400ms;
  line.twin(1).manner.think = 150ms;
  line.RunFor(1s);
  const DeviceStatus status = line.StatusOf(0);
  EXPECT_EQ(status.late, 1U);
  EXPECT_GE(status.lateness, 200ms);
  EXPECT_LT(status.lateness, 220ms);
  EXPECT_EQ(line.StatusOf(1).late, 0U);
}

TEST(PollerLate, ADeviceThatIsLateFromTheBeginning) {
  for (Duration think = 150ms; think < 900ms; think += 13ms) {
    VirtualLine line(ToyLine({ToyDevice("a", "A", {"U1", "U2"})}), {&ToyProtocol()});
    SetTruth(line, 1, 2);
    line.always = [&] { ExpectOnlyTruth(line, 1, 2); };
    line.twin(0).manner.think = think;
    line.Open();
    line.RunFor(30s);
    if (::testing::Test::HasFatalFailure()) FAIL() << "think time " << FormatDuration(think);
  }
}

TEST(PollerLate, ADeviceThatIsAlwaysLateIsWaitedFor) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"U1"}), ToyDevice("b", "B", {"U1"})}),
                   {&ToyProtocol()});
  SetTruth(line, 2, 1);
  line.always = [&] { ExpectOnlyTruth(line, 2, 1); };
  line.Open();
  line.RunFor(1500ms);
  line.twin(0).manner.think = 220ms;  // reply time 200 ms, drain 50 ms
  line.RunFor(20s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
  EXPECT_EQ(line.QualityOf(1, 0), Quality::good);
  EXPECT_GT(line.StatusOf(0).patience, 20ms);
  EXPECT_EQ(line.StatusOf(1).patience, 0ms);
  EXPECT_GT(line.poller().accounts().line.counters().stray_bytes, 0U);
}

TEST(PollerLate, TheUserIsToldOnceAndWhatToDo) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
  line.Open();
  line.RunFor(1500ms);
  line.twin(0).manner.think = 300ms;
  line.RunFor(1min);
  ASSERT_EQ(line.warnings.size(), 1U);
  EXPECT_NE(line.warnings[0].find("timing.reply"), std::string::npos);
}

TEST(PollerLate, NoiseLongAfterAnExchangeIsNotALateAnswer) {
  config::Device device = ToyDevice("a", "A", {"1"});
  device.poll = 10s;
  VirtualLine line(ToyLine({device}), {&ToyProtocol()});
  line.Open();
  line.Inject(ToBytes("x"), 5s);
  line.RunFor(8s);
  EXPECT_TRUE(line.warnings.empty());
  EXPECT_EQ(line.poller().accounts().line.counters().stray_bytes, 1U);
}

TEST(PollerLate, ARecoveredRetryIsFollowedByTheSilenceThatItsTwinNeeds) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1", "2"})}), {&ToyProtocol()});
  line.Open();
  line.RunFor(1500ms);
  int late = 2;  // both the request and its retry are answered after 300 ms
  const std::size_t before = line.sent.size();
  line.twin(0).manner.distort = [&](Bytes reply) {
    line.twin(0).manner.think = late-- > 0 ? 300ms : 5ms;
    return reply;
  };
  line.RunFor(1400ms);
  ASSERT_GE(line.sent.size() - before, 3U);
  const Sent& retry = line.sent[before + 1];
  const Sent& next = line.sent[before + 2];
  EXPECT_EQ(line.sent[before].text, retry.text);
  EXPECT_GT(next.at - retry.at, 300ms) << "the retry's own answer is still under way";
}

}  // namespace
}  // namespace baudgate
