// Plans of a device that change or cannot be carried out, under virtual time.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "tests/support/virtual_line.h"

namespace baudgate {
namespace {

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

/// Four reads in a row are urgent, then a poll has its turn. Its reply takes query 0 out of the
/// plan, and all others have other numbers.
TEST(Poller, AReadThatWaitsGoesByItsPointWhenThePlanChanges) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1", "2", "3", "4", "5", "6"})}),
                   {&ToyProtocol()});
  line.Open();
  line.RunFor(2s - 10ms);
  line.twin(0).manner.instead = [](View request) -> std::optional<Bytes> {
    if (AsText(request) != "?A1\r") return std::nullopt;
    return ToyReply("A1~replan");
  };
  std::optional<WriteResult> result;
  WriteCommand command;
  command.kind = Reads{{1, 2, 3, 4, 5}};
  command.deadline = line.now().instant + 1h;
  command.done = [&result](const WriteResult& end) { result = end; };
  line.sent.clear();
  line.Submit(std::move(command));
  ASSERT_TRUE(line.RunUntil([&] { return result.has_value(); }, 800ms));
  EXPECT_EQ(line.CountSent("?A1"), 1U) << "in between";
  EXPECT_TRUE(result->read_back) << result->reason;
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

/// Many devices are silent to what they do not have.
TEST(Poller, SilenceToWhatWasNeverAnsweredTellsNothingOfTheDevice) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1", "2", "3", "4", "5"})}), {&ToyProtocol()});
  const std::string_view answered = "?A1\r";
  line.twin(0).manner.deliver = [&](View request, Bytes reply, Instant) {
    const bool silent = AsText(request).starts_with("?A") && AsText(request) != answered;
    return silent ? std::vector<TimedPiece>() : std::vector<TimedPiece>{{5ms, reply}};
  };
  line.Open();
  line.RunFor(60s);
  EXPECT_TRUE(Answers(line.StatusOf(0).state));
  EXPECT_FALSE(IsBad(line.QualityOf(0, 0))) << "it is read all the time";
  line.twin(0).manner.deliver = {};
  line.twin(0).manner.dead = true;
  line.RunFor(60s);
  EXPECT_EQ(line.StatusOf(0).state, DeviceState::offline);
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

}  // namespace
}  // namespace baudgate
