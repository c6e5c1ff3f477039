// Faults of devices and wires, under virtual time: damaged, broken and foreign replies, noise,
// babble. Above all: a wrong value is never Good.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <random>

#include "gateway/bus/poller/poller.h"
#include "tests/gateway/bus/poller/truth.h"

namespace baudgate {
namespace {

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
  EXPECT_EQ(line.poller().accounts().line.counters().bytes_in, 60'000U * 32);
  line.twin(0).manner.dead = false;
  line.RunFor(10s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
}

}  // namespace
}  // namespace baudgate
