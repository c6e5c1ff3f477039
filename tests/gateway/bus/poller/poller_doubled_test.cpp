// Replies that come twice, under virtual time: the second may pass for the answer to the next
// request.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/gateway/bus/poller/truth.h"

namespace baudgate {
namespace {

TEST(PollerFaults, DoubledRepliesDoNoHarm) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"U1", "U2"})}), {&ToyProtocol()});
  SetTruth(line, 1, 2);
  line.always = [&] { ExpectOnlyTruth(line, 1, 2); };
  line.twin(0).manner.copies = 2;  // glued
  line.Open();
  line.RunFor(10s);
  EXPECT_EQ(line.QualityOf(0, 1), Quality::good);
}

/// The last reading of the slow device may be wrong as well. After a rest that is longer than the
/// reply time of the fast device, a reply of the slow one may still come.
TEST(PollerFaults, ASecondReplyOfAFastDeviceDoubtsWhatASlowOneSaid) {
  config::Line bus = ToyLine({ToyDevice("a", "A", {"1"}), ToyDevice("b", "B", {"1"})});
  bus.devices[0].poll = 300ms;
  bus.devices[1].poll = 20s;
  bus.devices[1].timing.reply = 2s;
  bus.devices[1].timing.ceiling = 4s;
  VirtualLine line(std::move(bus), {&ToyProtocol()});
  bool doubled = false;
  const auto pieces = [&](View, Bytes reply, Instant) {
    std::vector<TimedPiece> said = {{20ms, reply}};
    if (std::exchange(doubled, false)) said.push_back({21ms, ToyReply("A1=77")});
    return said;
  };
  line.Open();
  line.twin(0).manner.deliver = pieces;
  ASSERT_TRUE(line.RunUntil([&] { return line.QualityOf(1, 0) == Quality::good; }, 5s));
  line.RunFor(500ms);
  const std::uint64_t before = line.StatusOf(1).exchanges;
  doubled = true;
  ASSERT_TRUE(line.RunUntil([&] { return line.StatusOf(0).doubled > 0; }, 1s));
  line.RunFor(2s);
  EXPECT_GT(line.StatusOf(1).exchanges, before) << "read again, long before its period is over";
}

/// A device that answers one request in a form that was not asked for, for good.
TEST(PollerFaults, AnOddFormOfOneReplyLeavesTheOtherValuesGood) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"U1", "2", "U3"})}), {&ToyProtocol()});
  line.twin(0).manner.instead = [](View request) -> std::optional<Bytes> {
    if (AsText(request) != "?A2\r") return std::nullopt;
    return ToyReply("A9=1");
  };
  line.Open();
  line.RunFor(10s);
  int uncertain = 0;
  line.always = [&] {
    const bool good =
        line.QualityOf(0, 0) == Quality::good && line.QualityOf(0, 2) == Quality::good;
    if (!good) ++uncertain;
  };
  line.RunFor(5min);
  EXPECT_EQ(uncertain, 0);
  EXPECT_NE(line.QualityOf(0, 1), Quality::good);
}

TEST(PollerFaults, ADeviceWhoseOnlyReplyHasAnOddFormIsNotOffline) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
  line.twin(0).manner.instead = [](View request) -> std::optional<Bytes> {
    if (AsText(request) != "?A1\r") return std::nullopt;
    return ToyReply("A9=1");
  };
  line.Open();
  line.RunFor(5min);
  EXPECT_TRUE(Answers(line.StatusOf(0).state)) << line.StatusOf(0).last_reason;
  EXPECT_NE(line.QualityOf(0, 0), Quality::good);
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
  EXPECT_TRUE(line.RunUntil([&] { return !is_wrong(); }, 600ms))
      << "without waiting for its period";
  EXPECT_EQ(line.QualityOf(0, static_cast<std::uint32_t>(last)), Quality::good);
}

INSTANTIATE_TEST_SUITE_P(Points, SecondReply, ::testing::Values(2, 12));

}  // namespace
}  // namespace baudgate
