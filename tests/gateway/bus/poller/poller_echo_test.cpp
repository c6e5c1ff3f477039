// Buses that echo, under virtual time: in every mode of `echo:`, in any chunking, with collisions.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "tests/support/virtual_line.h"

namespace baudgate {
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

TEST(PollerEcho, UnfilteredEchoIsToldOnceAndCounted) {
  EchoLine line(config::Echo::off);
  line.echo = Whole;
  line.RunFor(10s);
  ASSERT_EQ(line.warnings.size(), 1U);
  EXPECT_NE(line.warnings[0].find("echo: strip"), std::string::npos) << line.warnings[0];
  EXPECT_EQ(line.status().echoes, line.status().exchanges);
  EXPECT_EQ(line.status().collisions, 0U);
}

TEST(PollerEcho, AReplyThatEqualsNothingIsNoEcho) {
  EchoLine line(config::Echo::off);
  line.RunFor(10s);
  EXPECT_TRUE(line.warnings.empty());
  EXPECT_EQ(line.status().echoes, 0U);
}

TEST(PollerEcho, ABusThatEchoesNoMoreIsBelievedAgain) {
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

TEST_P(EchoModes, AnEchoIsTakenOutAndNotCountedAsReceived) {
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

TEST(PollerEcho, StripServesABusThatDoesNotEcho) {
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

TEST(PollerEcho, SilenceWithoutAnEchoIsSaidToBeThat) {
  EchoLine line(config::Echo::verify);
  line.twin(0).manner.dead = true;
  line.RunFor(10s);
  EXPECT_GT(line.status().Count(Outcome::no_reply), 0U);
  EXPECT_NE(line.StatusOf(0).last_reason.find("not even the echo"), std::string::npos);
}

TEST(PollerEcho, SilenceBehindAWholeEchoIsNoCollision) {
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

TEST(PollerEcho, ARingThatStopsEchoingIsAStateOfTheLine) {
  EchoLine line(config::Echo::verify);
  line.echo = Whole;
  line.RunFor(5s);
  EXPECT_FALSE(line.status().cut_since);
  line.echo = {};
  line.twin(0).manner.dead = true;
  line.RunFor(20s);
  EXPECT_TRUE(line.status().cut_since);
  const auto told = std::ranges::count_if(line.warnings, [](const std::string& warning) {
    return warning.find("ring is open") != std::string::npos;
  });
  EXPECT_EQ(told, 1);
  line.echo = Whole;
  line.twin(0).manner.dead = false;
  line.RunFor(2min);
  EXPECT_FALSE(line.status().cut_since);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
}

}  // namespace
}  // namespace baudgate
