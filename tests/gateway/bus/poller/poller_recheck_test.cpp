// Readings that jump, on a whole line.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "tests/gateway/bus/poller/poller_fixture.h"

namespace baudgate {
namespace {

config::Device Rechecked(std::vector<std::string> reads, config::Recheck recheck) {
  config::Device device = Polled(ToyDevice("a", "A", std::move(reads)), 1s);
  for (config::Point& point : device.points) point.recheck = recheck;
  return device;
}

class RecheckTest : public ::testing::Test {
 protected:
  void Use(config::Recheck recheck, std::vector<std::string> reads = {"1"}) {
    line_.emplace(ToyLine({Rechecked(std::move(reads), recheck)}),
                  std::vector<const Protocol*>{&ToyProtocol()});
    line_->twin(0).values.Set(0, std::int64_t{20});
    line_->Open();
    line_->RunFor(500ms);
  }
  /// The next reply says `word` in place of the value.
  void Damage(const std::string& word) {
    line_->twin(0).manner.instead = [word,
                                     once = true](View request) mutable -> std::optional<Bytes> {
      const std::string_view text = AsText(request);
      if (text[0] != '?' || !std::exchange(once, false)) return std::nullopt;
      return ToyReply(std::string(text.substr(1, text.size() - 2)) + "=" + word);
    };
  }

  std::optional<VirtualLine> line_;
};

TEST_F(RecheckTest, AQuietValueCostsOneRequestOnceAndNoneAfter) {
  Use(config::Recheck::jump);
  EXPECT_EQ(line_->QualityOf(0, 0), Quality::good);
  EXPECT_EQ(line_->StatusOf(0).rechecks, 1U);
  line_->RunFor(1min);
  EXPECT_EQ(line_->StatusOf(0).rechecks, 1U);
  EXPECT_EQ(line_->StatusOf(0).unconfirmed, 0U);
}

TEST_F(RecheckTest, ADamagedReadingIsNeverShown) {
  Use(config::Recheck::jump);
  bool shown = false;
  bool uncertain = false;
  line_->always = [&] {
    shown = shown || line_->ValueOf(0, 0) != Value(20.0);
    uncertain = uncertain || line_->QualityOf(0, 0) == Quality::uncertain;
  };
  Damage("84");
  line_->RunFor(900ms);
  EXPECT_FALSE(shown);
  EXPECT_TRUE(uncertain);
  EXPECT_EQ(line_->QualityOf(0, 0), Quality::good) << "within the same poll";
  EXPECT_EQ(line_->StatusOf(0).unconfirmed, 1U);
}

TEST_F(RecheckTest, AnOldValueDoesNotBecomeYounger) {
  Use(config::Recheck::jump);
  line_->RunFor(600ms);
  line_->twin(0).manner.instead = [turn = 0](View request) mutable -> std::optional<Bytes> {
    const std::string_view text = AsText(request);
    return ToyReply(std::string(text.substr(1, text.size() - 2)) + "=" +
                    (++turn % 2 != 0 ? "500" : "900"));
  };
  const auto before = *line_->AgeOf(0, 0);
  const auto began = line_->now().instant;
  line_->RunUntil([&] { return line_->QualityOf(0, 0) == Quality::uncertain; }, 3s);
  EXPECT_EQ(line_->ValueOf(0, 0), Value(20.0));
  EXPECT_EQ(*line_->AgeOf(0, 0), before + (line_->now().instant - began));
}

TEST_F(RecheckTest, AWriteIsSeenAtItsReadBack) {
  Use(config::Recheck::jump);
  line_->Write(0, 0, std::int64_t{70});
  EXPECT_TRUE(line_->RunUntil([&] { return !line_->ends.empty(); }, 500ms));
  EXPECT_EQ(line_->ValueOf(0, 0), Value(70.0));
  EXPECT_EQ(line_->QualityOf(0, 0), Quality::good);
}

TEST_F(RecheckTest, WithoutItNothingIsAskedTwice) {
  Use(config::Recheck::off);
  line_->twin(0).values.Set(0, std::int64_t{90});
  line_->RunFor(10s);
  EXPECT_EQ(line_->StatusOf(0).rechecks, 0U);
}

}  // namespace
}  // namespace baudgate
