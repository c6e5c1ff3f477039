// Tests of writes through the queue of a line: confirmed, refused, late, or never sent.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <memory>

#include "gateway/bus/poller/poller.h"
#include "tests/support/virtual_line.h"

namespace baudgate::bus {
namespace {

using Ends = std::vector<WriteEnd>;

class PollerCommand : public ::testing::Test {
 protected:
  void Open() {
    line_.Open();
    line_.RunFor(1500ms);
    line_.sent.clear();
  }
  WriteCommand Command(std::vector<PointWrite> writes, Duration within = 1h) {
    WriteCommand command;
    command.kind = std::move(writes);
    command.deadline = line_.now().instant + within;
    command.done = [this](const WriteResult& result) {
      line_.ends.push_back(result.end);
      reasons_.push_back(result.reason);
    };
    return command;
  }

  VirtualLine line_{ToyLine({ToyDevice("a", "A", {"1", "2", "S3", "E4", "Q5"})}), {&ToyProtocol()}};
  std::vector<std::string> reasons_;
};

TEST_F(PollerCommand, IsSentAtOnceConfirmedAndReadBack) {
  Open();
  ASSERT_TRUE(line_.Write(0, 0, 42.5));
  line_.RunFor(100ms);
  EXPECT_EQ(line_.ends, Ends{WriteEnd::ok});
  ASSERT_EQ(line_.sent.size(), 2U);
  EXPECT_EQ(line_.sent[0].text, "WA1=42.5\r");
  EXPECT_EQ(line_.sent[1].text, "?A1\r") << "the store shows what was written without waiting";
  EXPECT_EQ(line_.ValueOf(0, 0), Value(42.5));
}

TEST_F(PollerCommand, TheAnswerComesWhenTheStoreShowsTheNewValue) {
  Open();
  WriteCommand command = Command({{0, 42.5}});
  Value seen;
  command.done = [&](const WriteResult& result) {
    line_.ends.push_back(result.end);
    seen = line_.ValueOf(0, 0);
  };
  line_.Submit(std::move(command));
  line_.RunFor(200ms);
  EXPECT_EQ(line_.ends, Ends{WriteEnd::ok});
  EXPECT_EQ(seen, Value(42.5)) << "who reads at once must not get the value from before";
}

TEST_F(PollerCommand, AFailedReadBackDoesNotDelayTheAnswer) {
  Open();
  line_.twin(0).manner.instead = [](View request) -> std::optional<Bytes> {
    return request[0] == '?' ? std::optional(Bytes()) : std::nullopt;
  };
  ASSERT_TRUE(line_.Write(0, 0, 42.5));
  EXPECT_TRUE(line_.RunUntil([&] { return !line_.ends.empty(); }, 2s));
  EXPECT_EQ(line_.ends, Ends{WriteEnd::ok}) << "the write itself was confirmed";
}

TEST_F(PollerCommand, SeveralWritesGoInTheirOrderAndAreConfirmedOnce) {
  Open();
  line_.Submit(Command({{0, 1.0}, {1, 2.0}, {0, 3.0}}));
  line_.RunFor(200ms);
  EXPECT_EQ(line_.ends, Ends{WriteEnd::ok});
  ASSERT_GE(line_.sent.size(), 3U);
  EXPECT_EQ(line_.sent[0].text, "WA1=1\r");
  EXPECT_EQ(line_.sent[1].text, "WA2=2\r");
  EXPECT_EQ(line_.sent[2].text, "WA1=3\r");
  EXPECT_EQ(line_.CountSent("?A1"), 1U) << "read back once";
}

TEST_F(PollerCommand, TheFirstRefusalEndsTheCommand) {
  Open();
  line_.twin(0).manner.instead = [](View request) -> std::optional<Bytes> {
    if (request[0] != 'W') return std::nullopt;
    return ToyReply("A1~refused");
  };
  line_.Submit(Command({{0, 1.0}, {1, 2.0}}));
  line_.RunFor(200ms);
  EXPECT_EQ(line_.ends, Ends{WriteEnd::refused});
  EXPECT_NE(reasons_.at(0), "");
  EXPECT_EQ(line_.CountSent("W"), 1U);
}

TEST_F(PollerCommand, IsNotRepeatedWhenNoConfirmationComes) {
  Open();
  line_.twin(0).manner.dead = true;
  line_.Write(0, 0, 1.0);
  line_.RunFor(1s);
  EXPECT_EQ(line_.CountSent("W"), 1U) << "it may have been carried out";
  EXPECT_EQ(line_.ends, Ends{WriteEnd::unknown});
}

TEST_F(PollerCommand, TheSessionIsClosedAfterAFailedWriteAndTheFailureReported) {
  Open();
  line_.twin(0).manner.distort = [](Bytes reply) { return reply; };
  line_.twin(0).manner.instead = [](View request) -> std::optional<Bytes> {
    if (request[0] != 'W') return std::nullopt;
    return Bytes{'?'};
  };
  line_.Write(0, 2, 9.0);
  line_.RunFor(1s);
  EXPECT_EQ(line_.CountSent("WA3"), 1U);
  EXPECT_EQ(line_.CountSent("CA0"), 1U);
  EXPECT_EQ(line_.ends, Ends{WriteEnd::refused});
}

TEST_F(PollerCommand, AWriteWithoutARequestIsRefused) {
  Open();
  line_.Write(0, 3, 1.0);
  EXPECT_EQ(line_.ends, Ends{WriteEnd::refused});
  EXPECT_EQ(line_.StatusOf(0).state, DeviceState::online);
}

TEST_F(PollerCommand, AnEmptyCommandSucceeds) {
  Open();
  line_.Submit(Command({}));
  EXPECT_EQ(line_.ends, Ends{WriteEnd::ok});
}

TEST_F(PollerCommand, AWriteWithoutReplySucceedsButDoesNotCountAsAnAnswer) {
  Open();
  line_.twin(0).manner.dead = true;
  line_.RunFor(1400ms);
  ASSERT_EQ(line_.StatusOf(0).state, DeviceState::degraded);
  const auto last_ok = line_.StatusOf(0).last_ok;
  line_.Write(0, 4, 1.0);
  ASSERT_TRUE(line_.RunUntil([&] { return !line_.ends.empty(); }, 2s));
  EXPECT_EQ(line_.ends, Ends{WriteEnd::ok}) << "nothing more can be known";
  EXPECT_EQ(line_.StatusOf(0).state, DeviceState::degraded);
  EXPECT_EQ(line_.StatusOf(0).last_ok, last_ok);
}

TEST_F(PollerCommand, AWriteToAnOfflineDeviceOrAClosedLineFailsAtOnce) {
  line_.Write(0, 0, 1.0);
  EXPECT_EQ(line_.ends, Ends{WriteEnd::not_sent});
  line_.twin(0).manner.dead = true;
  line_.Open();
  line_.RunFor(1min);
  ASSERT_TRUE(line_.RunUntil([&] { return line_.asking(); }, 1s));
  ASSERT_TRUE(line_.RunUntil([&] { return !line_.asking(); }, 1s));
  line_.RunFor(150ms);
  line_.Write(0, 0, 1.0);
  EXPECT_EQ(line_.ends, (Ends{WriteEnd::not_sent, WriteEnd::not_sent}));
  EXPECT_EQ(line_.CountSent("W"), 0U);
}

TEST_F(PollerCommand, WaitingCommandIsAnsweredAtItsDeadlineAndNeverSent) {
  Open();
  line_.twin(0).manner.dead = true;
  line_.RunFor(510ms);
  ASSERT_TRUE(line_.asking());
  const Instant submitted = line_.now().instant;
  line_.Write(0, 0, 1.0, 20ms);
  ASSERT_TRUE(line_.RunUntil([&] { return !line_.ends.empty(); }, 1s));
  EXPECT_EQ(line_.now().instant - submitted, 20ms) << "at its deadline, not when the line is free";
  EXPECT_EQ(line_.ends, Ends{WriteEnd::not_sent});
  line_.RunFor(3s);
  EXPECT_EQ(line_.CountSent("W"), 0U);
  EXPECT_EQ(line_.ends.size(), 1U);
}

TEST_F(PollerCommand, IsNotSentAfterItsDeadlineWhenTheProgramResumes) {
  Open();
  ASSERT_TRUE(line_.RunUntil([&] { return line_.asking(); }, 1s));
  ASSERT_TRUE(line_.RunUntil([&] { return !line_.asking(); }, 1s));
  line_.Write(0, 0, 1.0, 100ms);
  line_.Stop(1s, true);
  EXPECT_EQ(line_.ends, Ends{WriteEnd::not_sent});
  line_.RunFor(3s);
  EXPECT_EQ(line_.CountSent("W"), 0U);
}

TEST_F(PollerCommand, IsNotSentWhileALateAnswerCouldConfirmIt) {
  Open();
  line_.twin(0).manner.dead = true;
  line_.Write(0, 0, 1.0);
  ASSERT_TRUE(line_.RunUntil([&] { return !line_.ends.empty(); }, 1s));
  const Instant failed = line_.now().instant;
  line_.twin(0).manner.dead = false;
  line_.sent.clear();
  line_.Write(0, 0, 2.0, 100ms);
  line_.Write(0, 0, 3.0, 10s);
  ASSERT_TRUE(line_.RunUntil([&] { return line_.ends.size() == 3; }, 5s));
  EXPECT_EQ(line_.ends, (Ends{WriteEnd::unknown, WriteEnd::not_sent, WriteEnd::ok}));
  EXPECT_GE(line_.sent.front().at - failed, 800ms) << "the ceiling of the write that failed";
  EXPECT_EQ(line_.CountSent("WA1=2"), 0U) << "its deadline came first";
}

TEST_F(PollerCommand, TheWriteIsNotSentAfterTheDeadlineAndTheSessionIsClosed) {
  line_.twin(0).manner.deliver = [](View request, Bytes reply, Instant) {
    const Duration think = request[0] == 'O' ? 190ms : 5ms;
    return std::vector<tools::TimedPiece>{{think, std::move(reply)}};
  };
  line_.Open();
  ASSERT_TRUE(line_.Write(0, 2, 7.5, 100ms));
  ASSERT_TRUE(line_.RunUntil([&] { return !line_.ends.empty(); }, 2s));
  EXPECT_NE(line_.ends[0], WriteEnd::ok);
  EXPECT_EQ(line_.CountSent("OA9"), 1U);
  EXPECT_EQ(line_.CountSent("WA3"), 0U);
  EXPECT_EQ(line_.CountSent("CA0"), 1U);
}

TEST_F(PollerCommand, EachOfManyWritesIsAnsweredWithoutWaitingForTheLast) {
  Open();
  line_.twin(0).manner.think = 100ms;
  for (int i = 0; i < 10; ++i) line_.Write(0, i % 2, 1.0 + i, 3s);
  line_.RunFor(1s);
  EXPECT_GE(line_.ends.size(), 3U);
  line_.RunFor(10s);
  ASSERT_EQ(line_.ends.size(), 10U);
  EXPECT_EQ(
      static_cast<std::size_t>(std::count(line_.ends.begin(), line_.ends.end(), WriteEnd::ok)),
      line_.CountSent("WA"))
      << "what was confirmed is told so";
}

TEST_F(PollerCommand, ADeviceTakenOutOfUseIsNotWrittenToAnyMore) {
  Open();
  line_.Submit(Command({{0, 1.0}, {1, 2.0}, {0, 3.0}}));
  line_.poller().SetInUse(0, false, line_.now());
  line_.RunFor(5s);
  EXPECT_EQ(line_.CountSent("W"), 1U) << "that was under way";
  EXPECT_EQ(line_.ends, Ends{WriteEnd::not_sent});
  EXPECT_EQ(line_.CountSent("?"), 0U);
}

TEST_F(PollerCommand, IsNotBegunAfterItsClientHasLeft) {
  Open();
  const auto left = std::make_shared<std::atomic<bool>>(false);
  WriteCommand first = Command({{0, 1.0}, {1, 2.0}});
  WriteCommand second = Command({{0, 3.0}});
  first.abandoned = second.abandoned = left;
  line_.Submit(std::move(first));
  line_.Submit(std::move(second));
  *left = true;
  line_.RunFor(1s);
  EXPECT_EQ(line_.CountSent("W"), 2U) << "what was begun is ended";
  EXPECT_EQ(line_.ends, (Ends{WriteEnd::not_sent, WriteEnd::ok}));
}

TEST_F(PollerCommand, AWriteUnderWayMayEndBeforeThePortIsLent) {
  Open();
  ASSERT_TRUE(line_.Write(0, 2, 7.5));
  ASSERT_TRUE(line_.Write(0, 0, 1.0));
  EXPECT_TRUE(line_.poller().IsWriting());
  line_.poller().WindUp();
  EXPECT_TRUE(line_.RunUntil([&] { return !line_.poller().IsWriting(); }, 1s));
  EXPECT_EQ(line_.CountSent("CA0"), 1U);
  line_.RunFor(2s);
  EXPECT_EQ(line_.CountSent("WA1"), 0U) << "nothing is begun";
  EXPECT_EQ(line_.CountSent("?"), 0U);
  line_.Close();
  EXPECT_EQ(line_.ends.size(), 2U);
}

TEST_F(PollerCommand, AFullQueueRefusesWrites) {
  Open();
  line_.twin(0).manner.think = 150ms;
  std::size_t taken = 0;
  while (line_.Write(0, 0, 1.0)) ++taken;
  EXPECT_EQ(taken, Poller::kQueueLimit + 1) << "one is under way";
  line_.RunFor(30s);
  EXPECT_EQ(line_.ends, Ends(taken, WriteEnd::ok)) << "and every one of them was answered";
}

TEST_F(PollerCommand, ClosingThePortAnswersAllWaitingCommands) {
  Open();
  line_.twin(0).manner.think = 150ms;
  for (int i = 0; i < 5; ++i) line_.Write(0, 0, 1.0);
  line_.RunFor(20ms);
  line_.Close();
  EXPECT_EQ(line_.ends, (Ends{WriteEnd::unknown, WriteEnd::not_sent, WriteEnd::not_sent,
                              WriteEnd::not_sent, WriteEnd::not_sent}))
      << "the first was under way";
}

TEST_F(PollerCommand, AnEndlessStreamOfWritesDoesNotStarvePolls) {
  Open();
  const Instant end = line_.now().instant + 10s;
  line_.always = [&] {
    while (line_.now().instant < end && line_.Write(0, 0, 1.0)) {
    }
  };
  line_.RunFor(10s);
  EXPECT_GE(line_.CountSent("?A2"), 8U);
  EXPECT_EQ(line_.QualityOf(0, 1), Quality::good);
}

TEST(PollerCommands, AnEndlessStreamOfWritesThatADeviceIgnoresDoesNotStarveItsPolls) {
  config::Device device = ToyDevice("a", "A", {"1", "2", "3", "4"});
  VirtualLine line(ToyLine({device, ToyDevice("b", "B", {"1", "2"})}), {&ToyProtocol()});
  line.Open();
  line.RunFor(1500ms);
  line.twin(0).manner.instead = [](View request) -> std::optional<Bytes> {
    if (request[0] != 'W') return std::nullopt;
    return Bytes();
  };
  line.always = [&] {
    while (line.Write(0, 3, 1.0)) {
    }
  };
  for (int second = 0; second < 30; ++second) {
    line.RunFor(1s);
    for (std::uint32_t point = 0; point < 3; ++point) {
      EXPECT_EQ(line.QualityOf(0, point), Quality::good) << second << " " << point;
    }
  }
  EXPECT_GE(line.CountSent("WA4"), 15U);
}

TEST_F(PollerCommand, TheDoneCallbackMaySubmitTheNextCommand) {
  Open();
  int left = 3;
  std::function<void()> submit = [&] {
    WriteCommand command = Command({{0, 1.0}});
    command.done = [&](const WriteResult& result) {
      line_.ends.push_back(result.end);
      if (--left > 0) submit();
    };
    line_.Submit(std::move(command));
  };
  submit();
  line_.RunFor(1s);
  EXPECT_EQ(line_.ends, Ends(3, WriteEnd::ok));
}

TEST(PollerSync, AWriteIsNotConfirmedByTheReplyToItsProbe) {
  config::Device device = ToyDevice("a", "A", {"1"});
  device.options.Set("wait", std::int64_t{Duration(1s).count()});
  VirtualLine line(ToyLine({device}), {&ToyProtocol()});
  line.Open();
  line.RunFor(1500ms);
  int polls = 0;
  line.twin(0).manner.instead = [&](View request) -> std::optional<Bytes> {
    if (request[0] != '?' || polls++ > 1) return std::nullopt;
    return polls == 1 ? Bytes() : ToyReply("A1~busy");
  };
  ASSERT_TRUE(line.RunUntil([&] { return polls == 2; }, 2s));
  line.RunFor(50ms);
  line.Write(0, 0, 7.0);
  ASSERT_TRUE(line.RunUntil([&] { return !line.ends.empty(); }, 5s));
  EXPECT_EQ(line.ends[0], WriteEnd::ok);
  EXPECT_EQ(line.CountSent("W"), 1U) << "confirmed, and so sent";
  EXPECT_EQ(line.twin(0).values.Get(0, {}), Value(7.0));
}

TEST(PollerSync, AWriteAfterAProbeKeepsItsDeadline) {
  config::Line config = ToyLine({ToyDevice("a", "A", {"1"})});
  config.retries = 0;
  config.timing.ceiling = 5s;
  VirtualLine line(config, {&ToyProtocol()});
  line.Open();
  line.RunFor(1500ms);
  line.twin(0).manner.dead = true;
  ASSERT_TRUE(line.RunUntil([&] { return line.StatusOf(0).Count(Outcome::no_reply) == 1; }, 2s));
  line.Write(0, 0, 7.0, 500ms);
  line.RunFor(510ms);
  EXPECT_EQ(line.ends, std::vector<WriteEnd>{WriteEnd::not_sent});
  EXPECT_EQ(line.CountSent("W"), 0U);
}

}  // namespace
}  // namespace baudgate::bus
