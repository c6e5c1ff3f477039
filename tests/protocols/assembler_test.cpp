// Tests Assembler, the buffering loop around frame rules. tests/laws has the laws of real rules.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/assembler.h"

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include "tests/support/toy_protocol.h"

namespace baudgate::protocols {
namespace {

class AssemblerTest : public ::testing::Test {
 protected:
  void Begin() {
    const Protocol& toy = ToyProtocol();
    assembler_.Begin(toy.reply_rule, toy.expect(ToBytes("?A1\r"), {}));
  }
  std::vector<std::string> Take(bool idle = false) {
    std::vector<std::string> frames;
    while (const auto frame = assembler_.Next(idle)) frames.emplace_back(AsText(*frame));
    ExpectConservation();
    return frames;
  }
  void ExpectConservation() const {
    const AssemblerCounters& count = assembler_.counters();
    EXPECT_EQ(count.in, count.delivered + count.discarded + assembler_.held());
  }

  Assembler assembler_;
  const Bytes frame_ = ToyReply("A1=5");
};

TEST_F(AssemblerTest, TwoFramesInOnePieceAreReturned) {
  Begin();
  assembler_.Feed(frame_);
  assembler_.Feed(frame_);
  EXPECT_EQ(Take().size(), 2U);
  EXPECT_EQ(assembler_.held(), 0U);
  EXPECT_EQ(assembler_.blame(), Outcome::none);
}

TEST_F(AssemblerTest, DamageIsReportedAndTheNextFrameIsFound) {
  Begin();
  Bytes stream = frame_;
  stream[4] ^= 0x01;
  Append(stream, frame_);
  for (const std::uint8_t byte : stream) assembler_.Feed(View(&byte, 1));
  EXPECT_EQ(Take().size(), 1U);
  EXPECT_EQ(assembler_.blame(), Outcome::corrupt);
  EXPECT_EQ(assembler_.why(), "checksum");
  EXPECT_EQ(assembler_.counters().discarded, frame_.size());
}

TEST_F(AssemblerTest, AnIncompleteFrameIsPartialOnlyAfterSilence) {
  Begin();
  assembler_.Feed(View(frame_).first(4));
  EXPECT_TRUE(Take(false).empty());
  EXPECT_EQ(assembler_.blame(), Outcome::none);
  EXPECT_EQ(assembler_.held(), 4U);
  EXPECT_TRUE(Take(true).empty());
  EXPECT_EQ(assembler_.blame(), Outcome::partial);
  EXPECT_EQ(assembler_.held(), 0U);
}

TEST_F(AssemblerTest, HarmlessNoiseIsNotReportedAsDamage) {
  Begin();
  assembler_.Feed(Bytes{0, 0, 0});
  EXPECT_TRUE(Take(true).empty());
  EXPECT_EQ(assembler_.blame(), Outcome::none);
  EXPECT_EQ(assembler_.counters().discarded, 3U);
}

TEST_F(AssemblerTest, TheWorstDamageIsKept) {
  Begin();
  assembler_.Feed(ToBytes("x!A1"));
  Take(true);
  EXPECT_EQ(assembler_.blame(), Outcome::corrupt);
  EXPECT_EQ(assembler_.why(), "noise before frame");
}

TEST_F(AssemblerTest, BeginDiscardsEarlierBytes) {
  Begin();
  assembler_.Feed(ToBytes("x!A1"));
  Take(false);
  Begin();
  EXPECT_EQ(assembler_.held(), 0U);
  EXPECT_EQ(assembler_.blame(), Outcome::none);
  assembler_.Feed(View(frame_).subspan(3));
  EXPECT_TRUE(Take(true).empty()) << "the head of the last exchange was kept";
}

TEST_F(AssemblerTest, AnEndlessFrameIsBounded) {
  Begin();
  for (int i = 0; i < 100'000; ++i) {
    assembler_.Feed(ToBytes(i == 0 ? "!" : "A"));
    EXPECT_TRUE(Take().empty());
    ASSERT_LE(assembler_.held(), 64U);
    if (i < 64) {
      ASSERT_EQ(assembler_.blame(), Outcome::none) << "the longest reply has room";
    }
  }
  EXPECT_EQ(assembler_.blame(), Outcome::corrupt);
  assembler_.Feed(frame_);
  EXPECT_EQ(Take().size(), 1U) << "a frame behind the overflow has its chance";
}

TEST_F(AssemblerTest, AnInvalidCutOfARuleIsHarmless) {
  assembler_.Begin([](View, const Expectation&, bool) { return Cut::Frame(1000); }, {});
  assembler_.Feed(ToBytes("abc"));
  EXPECT_EQ(Take(), std::vector<std::string>{"abc"});
  assembler_.Begin(
      [](View, const Expectation&, bool) { return Cut::Discard(0, Outcome::corrupt, "!"); }, {});
  assembler_.Feed(ToBytes("abc"));
  EXPECT_TRUE(Take().empty()) << "an answer without progress would never end";
  EXPECT_EQ(assembler_.held(), 0U);
}

TEST_F(AssemblerTest, FramesInRandomStreamsAreFound) {
  std::mt19937 random(1);
  for (int round = 0; round < 300; ++round) {
    Begin();
    std::size_t good = 0;
    std::size_t found = 0;
    for (int piece = 0; piece < 30; ++piece) {
      Bytes bytes = frame_;
      if (random() % 2 == 0) {
        bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
        bytes.resize(1 + random() % bytes.size());
      } else {
        ++good;
      }
      assembler_.Feed(bytes);
      if (random() % 3 != 0) found += Take().size();
    }
    found += Take(true).size();
    EXPECT_LE(good, found + 30);
    EXPECT_GT(found, 0U);
    EXPECT_EQ(assembler_.held(), 0U);
  }
}

}  // namespace
}  // namespace baudgate::protocols
