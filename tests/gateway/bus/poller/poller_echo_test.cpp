// Tests of buses that echo, of faulty devices and of late replies, under virtual time.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <random>

#include "gateway/bus/poller/poller.h"
#include "tests/gateway/bus/poller/truth.h"
#include "tests/support/virtual_line.h"

namespace baudgate::bus {
namespace {

Bytes Whole(View request) { return Bytes(request.begin(), request.end()); }

struct EchoLine : VirtualLine {
  explicit EchoLine(config::Echo mode, std::vector<std::string> reads = {"1"})
      : VirtualLine(Configured(mode, std::move(reads)), {&ToyProtocol()}) {
    twin(0).values.Set(0, 42.0);
    Open();
  }
  LineStatus status() { return store().ReadLine(0); }

 private:
  static config::Line Configured(config::Echo mode, std::vector<std::string> reads) {
    config::Line line = ToyLine({ToyDevice("a", "A", std::move(reads))});
    line.echo = mode;
    return line;
  }
};

TEST(PollerEcho, AnUnfilteredEchoIsWarnedOfOnceAndCounted) {
  EchoLine line(config::Echo::off);
  line.echo = Whole;
  line.RunFor(10s);
  ASSERT_EQ(line.warnings.size(), 1U);
  EXPECT_NE(line.warnings[0].find("echo: strip"), std::string::npos) << line.warnings[0];
  EXPECT_EQ(line.status().echoes, line.status().exchanges);
  EXPECT_EQ(line.status().collisions, 0U);
}

TEST(PollerEcho, AReplyUnlikeItsRequestIsNoEcho) {
  EchoLine line(config::Echo::off);
  line.RunFor(10s);
  EXPECT_TRUE(line.warnings.empty());
  EXPECT_EQ(line.status().echoes, 0U);
}

TEST(PollerEcho, RepliesAreAcceptedAgainWhenTheBusStopsEchoing) {
  EchoLine line(config::Echo::off);
  line.echo = Whole;
  line.RunFor(5s);
  const auto echoes = line.status().echoes;
  EXPECT_GT(echoes, 0U);
  line.echo = {};
  line.RunFor(5s);
  EXPECT_LE(line.status().echoes, echoes + 1);
  EXPECT_EQ(line.StatusOf(0).last_outcome, Outcome::ok);
}

class EchoModes : public ::testing::TestWithParam<config::Echo> {};

TEST_P(EchoModes, AnEchoIsRemovedAndNotCountedAsReceived) {
  EchoLine line(GetParam());
  line.echo = Whole;
  line.RunFor(10s);
  const LineStatus status = line.status();
  EXPECT_EQ(status.Count(Outcome::ok), status.exchanges);
  EXPECT_EQ(line.ValueOf(0, 0), Value(42.0));
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
  EXPECT_EQ(status.bytes_in,
            4 * ToyReply("A0").size() + (status.exchanges - 4) * ToyReply("A1=42").size());
  EXPECT_EQ(status.collisions, 0U);
  EXPECT_TRUE(line.warnings.empty());
}

INSTANTIATE_TEST_SUITE_P(Taken, EchoModes,
                         ::testing::Values(config::Echo::strip, config::Echo::verify));

TEST(PollerEcho, StripModePollsABusThatDoesNotEcho) {
  EchoLine line(config::Echo::strip);
  line.RunFor(10s);
  EXPECT_EQ(line.status().Count(Outcome::ok), line.status().exchanges);
}

TEST(PollerEcho, ACollisionFailsTheExchangeAlthoughTheReplyIsGood) {
  EchoLine line(config::Echo::verify);
  line.echo = Whole;
  line.RunFor(2s);
  int collisions = 2;
  line.echo = [&](View request) {
    Bytes echo = Whole(request);
    if (collisions-- > 0) echo[2] ^= 0x04;
    return echo;
  };
  line.RunFor(10s);
  EXPECT_EQ(line.status().collisions, 2U);
  EXPECT_EQ(line.status().Count(Outcome::corrupt), 2U);
  EXPECT_EQ(line.StatusOf(0).retries, 2U) << "a read may be repeated";
  EXPECT_NE(line.StatusOf(0).last_reason.find("collision"), std::string::npos);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
  EXPECT_EQ(line.warnings.size(), 1U);
}

TEST(PollerEcho, AWriteThatCollidedIsNotConfirmed) {
  EchoLine line(config::Echo::verify);
  line.echo = [](View request) {
    Bytes echo = Whole(request);
    if (echo.front() == 'W') echo.back() ^= 0x01;
    return echo;
  };
  line.RunFor(2s);
  line.Write(0, 0, 7.0);
  line.RunFor(5s);
  ASSERT_EQ(line.ends.size(), 1U);
  EXPECT_EQ(line.ends[0], WriteEnd::unknown);
}

TEST(PollerEcho, AReplyWithoutItsEchoIsNotTrustedInVerifyMode) {
  EchoLine line(config::Echo::verify);
  line.RunFor(10s);
  const LineStatus status = line.status();
  EXPECT_EQ(status.Count(Outcome::ok), 0U);
  EXPECT_EQ(status.collisions, status.exchanges);
  EXPECT_FALSE(HasValue(line.ValueOf(0, 0)));
}

TEST(PollerEcho, SilenceWithoutAnEchoIsReportedAsAMissingEcho) {
  EchoLine line(config::Echo::verify);
  line.twin(0).manner.dead = true;
  line.RunFor(10s);
  EXPECT_GT(line.status().Count(Outcome::no_reply), 0U);
  EXPECT_NE(line.StatusOf(0).last_reason.find("not even the echo"), std::string::npos);
}

TEST(PollerEcho, SilenceAfterAWholeEchoIsNoCollision) {
  EchoLine line(config::Echo::verify);
  line.echo = Whole;
  line.twin(0).manner.dead = true;
  line.RunFor(10s);
  EXPECT_GT(line.status().Count(Outcome::no_reply), 0U);
  EXPECT_EQ(line.status().collisions, 0U);
}

TEST(PollerEcho, AnEchoThatStopsHalfwayIsCounted) {
  EchoLine line(config::Echo::verify);
  line.echo = [](View request) { return Bytes(request.begin(), request.begin() + 3); };
  line.twin(0).manner.dead = true;
  line.RunFor(10s);
  EXPECT_EQ(line.status().collisions, line.status().exchanges);
  EXPECT_NE(line.StatusOf(0).last_reason.find("broke off"), std::string::npos);
}

TEST(PollerEcho, ARingThatStopsEchoingIsReportedAsCut) {
  EchoLine line(config::Echo::verify);
  line.echo = Whole;
  line.RunFor(5s);
  EXPECT_FALSE(line.status().cut_since);
  line.echo = {};
  line.twin(0).manner.dead = true;
  line.RunFor(20s);
  EXPECT_TRUE(line.status().cut_since);
  const auto told = std::ranges::count_if(line.warnings, [](const std::string& warning) {
    return warning.find("does not echo any more") != std::string::npos;
  });
  EXPECT_EQ(told, 1);
  line.echo = Whole;
  line.twin(0).manner.dead = false;
  line.RunFor(2min);
  EXPECT_FALSE(line.status().cut_since);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
}

TEST(PollerFaults, NoiseAfterOneReplyDoesNotSlowTheLineForEver) {
  config::Line config = ToyLine({ToyDevice("a", "A", {"1"})});
  config.devices[0].poll = 10ms;
  VirtualLine line(std::move(config), {&ToyProtocol()});
  line.twin(0).manner.think = 0ms;
  line.Open();
  line.RunFor(10s);
  const auto rate = [&] {
    const std::uint32_t before = line.StatusOf(0).exchanges;
    line.RunFor(10s);
    return line.StatusOf(0).exchanges - before;
  };
  const std::uint32_t clean = rate();
  std::size_t replies = 0;
  line.twin(0).manner.distort = [&](Bytes reply) {
    if (++replies == 2) reply.push_back(0);
    return reply;
  };
  line.RunFor(1min);
  EXPECT_GE(rate(), clean - clean / 50);
}

TEST(PollerFaults, ADeviceWithAWrongAddressSlowsANeighbourByAtMostFivePercent) {
  const auto answered_in_a_minute = [](bool wrong) {
    VirtualLine line(ToyLine({ToyDevice("a", "A", {"1", "2"}), ToyDevice("b", "B", {"1", "2"})}),
                     {&ToyProtocol()});
    line.Open();
    line.RunFor(5s);
    if (wrong) {
      line.twin(0).manner.instead = [](View request) {
        const std::string_view text = AsText(request);
        return std::optional(ToyReply("Z" + std::string(text.substr(2, text.size() - 3)) + "=5"));
      };
    }
    Instant last = line.now().instant;
    Duration longest{};
    line.always = [&] {
      if (!line.sent.empty() && line.sent.back().text[1] == 'B' && line.sent.back().at != last) {
        longest = std::max(longest, line.sent.back().at - last);
        last = line.sent.back().at;
      }
    };
    const std::uint32_t before = line.StatusOf(1).Count(Outcome::ok);
    line.RunFor(1min);
    EXPECT_LE(longest, 2s);
    return line.StatusOf(1).Count(Outcome::ok) - before;
  };
  EXPECT_GE(answered_in_a_minute(true), 0.95 * answered_in_a_minute(false));
}

TEST(PollerFaults, ADribblingDeviceGoesOfflineAndItsNeighbourStaysGood) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1", "2"}), ToyDevice("b", "B", {"1", "2"})}),
                   {&ToyProtocol()});
  line.Open();
  line.RunFor(5s);
  line.twin(0).manner.fragment = 1;
  line.twin(0).manner.pause = 45ms;
  const Instant began = line.now().instant;
  const std::uint32_t before = line.StatusOf(1).Count(Outcome::ok);
  ASSERT_TRUE(line.RunUntil([&] { return line.StatusOf(0).state == DeviceState::offline; }, 1min));
  line.RunFor(began + 1min - line.now().instant);
  EXPECT_GE(line.StatusOf(1).Count(Outcome::ok) - before, 100U) << "of 120";
  EXPECT_EQ(line.QualityOf(1, 0), Quality::good);
}

TEST(PollerFaults, TheRestOfABrokenReplyIsNotALateReply) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
  line.Open();
  line.RunFor(1500ms);
  line.twin(0).manner.fragment = 3;
  line.twin(0).manner.pause = 120ms;
  line.RunFor(10s);
  EXPECT_GT(line.StatusOf(0).Count(Outcome::partial), 0U);
  EXPECT_EQ(line.StatusOf(0).late, 0U);
  ASSERT_FALSE(line.warnings.empty());
  EXPECT_NE(line.warnings[0].find("timing.gap"), std::string::npos) << line.warnings[0];
}

TEST(PollerFaults, AForeignAnswerIsUnexpectedAndNotStored) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
  SetTruth(line, 1, 1);
  line.always = [&] { ExpectOnlyTruth(line, 1, 1); };
  line.twin(0).manner.instead = [](View) { return ToyReply("B1=77"); };
  line.Open();
  line.RunFor(10s);
  EXPECT_EQ(line.StatusOf(0).Count(Outcome::unexpected), line.StatusOf(0).exchanges);
  EXPECT_FALSE(HasValue(line.ValueOf(0, 0)));
  EXPECT_NE(line.StatusOf(0).last_reason, "");
}

TEST(PollerFaults, RandomDamageNeverGivesAWrongValue) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    std::mt19937 random(seed);
    VirtualLine line(ToyLine({ToyDevice("a", "A", {"1", "2"}), ToyDevice("b", "B", {"1", "2"})}),
                     {&ToyProtocol()});
    SetTruth(line, 2, 2);
    line.always = [&] { ExpectOnlyTruth(line, 2, 2); };
    for (std::size_t i = 0; i < 2; ++i) {
      Manner& manner = line.twin(i).manner;
      manner.fragment = i;
      manner.distort = [&random, &manner](Bytes reply) {
        manner.think = std::chrono::milliseconds(random() % 260);
        switch (random() % 8) {
          case 0:
            reply[random() % reply.size()] ^= static_cast<std::uint8_t>(1U << random() % 8);
            break;
          case 1:
            reply.resize(random() % reply.size());
            break;
          case 2:
            reply.insert(reply.begin(), {0x55, '!', 'A'});
            break;
          default:
            break;
        }
        return reply;
      };
    }
    line.Open();
    line.RunFor(60s);
    EXPECT_GT(line.StatusOf(0).Count(Outcome::ok), 10U) << "seed " << seed;
    if (::testing::Test::HasFatalFailure()) FAIL() << "seed " << seed;
  }
}

TEST(PollerFaults, AReplyThatStopsMidFrameIsPartial) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
  line.twin(0).manner.distort = [](Bytes reply) {
    reply.resize(4);
    return reply;
  };
  line.Open();
  line.RunFor(10s);
  EXPECT_EQ(line.StatusOf(0).Count(Outcome::partial), line.StatusOf(0).exchanges);
  EXPECT_EQ(line.StatusOf(0).state, DeviceState::offline);
}

TEST(PollerFaults, ABabblingDeviceGoesOfflineAndTheLineRecovers) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"}), ToyDevice("b", "B", {"1"})}),
                   {&ToyProtocol()});
  SetTruth(line, 2, 1);
  line.always = [&] { ExpectOnlyTruth(line, 2, 1); };
  line.Open();
  line.RunFor(2s);
  line.twin(0).manner.babble = 20s;
  line.RunFor(2min);
  EXPECT_EQ(line.StatusOf(0).state, DeviceState::offline);
  line.twin(0).manner.babble = {};
  EXPECT_TRUE(line.RunUntil([&] { return line.QualityOf(1, 0) == Quality::good; }, 1min));
  EXPECT_TRUE(line.RunUntil([&] { return line.QualityOf(0, 0) == Quality::good; }, 1min));
}

TEST(PollerFaults, TheDeviceIsGoodAgainAfterAnEndlessStream) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
  line.twin(0).manner.dead = true;
  line.Open();
  const Bytes noise(32, 'U');
  for (int i = 0; i < 60'000; ++i) line.Inject(noise, i * 1ms);
  line.RunFor(60s);
  EXPECT_GT(line.sent.size(), 10U) << "the line goes on trying";
  EXPECT_EQ(line.poller().accounts().line.counters().bytes_in, 60'000U * 32);
  line.twin(0).manner.dead = false;
  line.RunFor(10s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
}

/// As in DCON, replies do not contain what was read. The device thinks for up to 900 ms, within the
/// ceiling of 1 s.
TEST(PollerLate, LateAnswersAreNeverStoredForOtherPoints) {
  for (Duration think = 5ms; think < 900ms; think += 11ms) {
    VirtualLine line(ToyLine({ToyDevice("a", "A", {"U1", "U2", "U3"})}), {&ToyProtocol()});
    SetTruth(line, 1, 3);
    line.always = [&] { ExpectOnlyTruth(line, 1, 3); };
    line.Open();
    line.RunFor(3s);
    line.twin(0).manner.think = think;
    line.RunFor(30s);
    if (::testing::Test::HasFatalFailure()) FAIL() << "think time " << FormatDuration(think);
  }
}

TEST(PollerLate, ALateAnswerIsNeverStoredForAnotherDevice) {
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

TEST(PollerLate, ALateReplyIsDetectedWhenItMeetsTheRetry) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
  line.Open();
  line.RunFor(1500ms);
  line.twin(0).manner.think = 300ms;  // more than the reply time of 200 ms and the drain of 50 ms
  line.RunFor(1500ms);
  const DeviceStatus status = line.StatusOf(0);
  EXPECT_GT(status.late, 0U);
  EXPECT_GE(status.lateness, 90ms);
  EXPECT_LE(status.lateness, 150ms);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
}

TEST(PollerLate, AReplyReadAfterAStopIsAsOldAsTheStop) {
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

TEST(PollerLate, ADeviceThatIsLateFromTheStartGivesNoWrongValues) {
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

TEST(PollerLate, AnAlwaysLateDeviceGetsMoreReplyTime) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"U1"}), ToyDevice("b", "B", {"U1"})}),
                   {&ToyProtocol()});
  SetTruth(line, 2, 1);
  line.always = [&] { ExpectOnlyTruth(line, 2, 1); };
  line.Open();
  line.RunFor(1500ms);
  // More than the reply time of 200 ms, within the drain of 50 ms.
  line.twin(0).manner.think = 220ms;
  line.RunFor(20s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
  EXPECT_EQ(line.QualityOf(1, 0), Quality::good);
  EXPECT_GT(line.StatusOf(0).patience, 20ms);
  EXPECT_EQ(line.StatusOf(1).patience, 0ms);
  EXPECT_GT(line.poller().accounts().line.counters().stray_bytes, 0U);
}

TEST(PollerLate, LateRepliesWarnOnceAndNameTheSetting) {
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

TEST(PollerLate, ARecoveredRetryIsFollowedByTimeForItsOwnReply) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1", "2"})}), {&ToyProtocol()});
  line.Open();
  line.RunFor(1500ms);
  int late = 2;
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
}  // namespace baudgate::bus
