// Faults of devices and wires, under virtual time: retries, late replies, doubled and damaged ones,
// babble. Above all: a wrong value is never Good.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <random>

#include "gateway/poll/poller.h"
#include "tests/support/virtual_line.h"

namespace baudgate {
namespace {

/// Truth that differs from point to point, so that a value at the wrong place is seen.
double TruthOf(std::size_t device, std::size_t point) {
  return static_cast<double>(1000 * (device + 1) + point);
}

void SetTruth(VirtualLine& line, std::size_t devices, std::size_t points) {
  for (std::size_t device = 0; device < devices; ++device) {
    for (std::size_t point = 0; point < points; ++point) {
      line.twin(device).values.Set(point, TruthOf(device, point));
    }
  }
}

/// Every value in the store is nothing or the truth, whatever its quality.
void ExpectOnlyTruth(VirtualLine& line, std::uint32_t devices, std::uint32_t points) {
  for (std::uint32_t device = 0; device < devices; ++device) {
    for (std::uint32_t point = 0; point < points; ++point) {
      const Value value = line.ValueOf(device, point);
      ASSERT_TRUE(!HasValue(value) || value == Value(TruthOf(device, point)))
          << "device " << device << " point " << point << " shows " << ToText(value) << " after "
          << FormatDuration(line.elapsed());
    }
  }
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

TEST(PollerRetries, OneLostReplyIsMadeUpForAtOnce) {
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

TEST(PollerRetries, TheConversationPutsAnotherRequestInItsPlace) {
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
  EXPECT_EQ(line.CountSent("BA1"), 1U);
  EXPECT_EQ(line.ValueOf(0, 0), Value(6.0)) << "what L destroyed, B repeats";
  EXPECT_EQ(line.StatusOf(0).Count(Outcome::corrupt), 1U);
}

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

TEST(PollerLate, AnAnswerWithinTheDrainBelongsToNobody) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"U1"}), ToyDevice("b", "B", {"U1"})}),
                   {&ToyProtocol()});
  SetTruth(line, 2, 1);
  line.always = [&] { ExpectOnlyTruth(line, 2, 1); };
  line.Open();
  line.RunFor(1500ms);
  line.twin(0).manner.think = 220ms;  // reply time 200 ms, drain 50 ms
  line.RunFor(20s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_communication);
  EXPECT_EQ(line.QualityOf(1, 0), Quality::good);
  EXPECT_GT(line.poller().ledger().counters().stray_bytes, 0U);
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
  EXPECT_EQ(line.poller().ledger().counters().stray_bytes, 1U);
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

TEST(PollerFaults, DoubledRepliesDoNoHarm) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"U1", "U2"})}), {&ToyProtocol()});
  SetTruth(line, 1, 2);
  line.always = [&] { ExpectOnlyTruth(line, 1, 2); };
  line.twin(0).manner.copies = 2;  // glued
  line.Open();
  line.RunFor(10s);
  EXPECT_EQ(line.QualityOf(0, 1), Quality::good);
}

/// A copy that comes after the next request has been sent passes for its answer. The true one comes
/// behind it: then what was read last is doubted at once, and read again.
class SecondReply : public ::testing::TestWithParam<std::size_t> {};

TEST_P(SecondReply, ACopyThatWasTakenForTheNextAnswerIsFoundOut) {
  const std::size_t last = GetParam() - 1;
  std::vector<std::string> reads;
  for (std::size_t i = 1; i <= GetParam(); ++i) reads.push_back("U" + std::to_string(i));
  const std::string doubled_one = "UA" + std::to_string(last) + "\r";
  VirtualLine line(ToyLine({ToyDevice("a", "A", reads)}), {&ToyProtocol()});
  SetTruth(line, 1, GetParam());
  bool doubled = false;
  const auto pieces = [&](View request, Bytes reply, Instant) {
    const Duration whole = static_cast<std::int64_t>(reply.size()) * 1042us;
    std::vector<TimedPiece> said = {{5ms + whole, reply}};
    if (doubled && AsText(request) == doubled_one) said.push_back({25ms + whole, reply});
    return said;
  };
  line.Open();
  line.RunFor(2500ms);
  line.twin(0).manner.deliver = pieces;
  doubled = true;
  bool wrong = false;
  const auto is_wrong = [&] {
    return line.ValueOf(0, static_cast<std::uint32_t>(last)) != Value(TruthOf(0, last));
  };
  line.always = [&] { wrong = wrong || is_wrong(); };
  line.RunFor(1s);
  ASSERT_TRUE(wrong) << "else this test shows nothing";
  doubled = false;
  line.always = {};
  ASSERT_FALSE(line.warnings.empty());
  EXPECT_NE(line.warnings.back().find("second, different reply"), std::string::npos);
  EXPECT_GE(line.StatusOf(0).doubled, 1U);
  EXPECT_TRUE(line.RunUntil([&] { return !is_wrong(); }, 300ms))
      << "without waiting for its period";
  EXPECT_EQ(line.QualityOf(0, static_cast<std::uint32_t>(last)), Quality::good);
}

INSTANTIATE_TEST_SUITE_P(Points, SecondReply, ::testing::Values(2, 12));

TEST(PollerFaults, NoiseBehindOneReplyDoesNotSlowTheLineForEver) {
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

/// One of two says that it is another; the line does not wait for what it may still say.
TEST(PollerFaults, ADeviceWithAWrongAddressCostsItsNeighbourNothing) {
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

/// Each of its replies takes the line for longer than a reply time.
TEST(PollerFaults, ADribblingDeviceIsGivenUpBeforeItsNeighbourIs) {
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

TEST(PollerFaults, TheRestOfABrokenReplyIsNoLateOne) {
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

TEST(PollerFaults, StoppedMidFrameIsPartial) {
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

TEST(PollerFaults, ABabblingDeviceHoldsTheLineOnlyBriefly) {
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

TEST(PollerFaults, AnEndlessStreamIsSurvived) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
  line.twin(0).manner.dead = true;
  line.Open();
  const Bytes noise(32, 'U');
  for (int i = 0; i < 60'000; ++i) line.Inject(noise, i * 1ms);
  line.RunFor(60s);
  EXPECT_GT(line.sent.size(), 10U) << "the line goes on trying";
  EXPECT_EQ(line.poller().ledger().counters().bytes_in, 60'000U * 32);
  line.twin(0).manner.dead = false;
  line.RunFor(10s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
}

}  // namespace
}  // namespace baudgate
