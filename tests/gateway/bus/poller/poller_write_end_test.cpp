// Tests of the results of writes that a client receives.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <vector>

#include "gateway/bus/poller/poller.h"
#include "gateway/bus/writes/write_gate.h"
#include "tests/support/virtual_line.h"

namespace baudgate::bus {
namespace {

class PollerWriteEnd : public ::testing::Test {
 protected:
  void SetUp() override {
    line_.Open();
    line_.RunFor(1500ms);
    line_.sent.clear();
  }
  WriteCommand Command(std::vector<PointWrite> writes) {
    WriteCommand command;
    command.kind = std::move(writes);
    command.deadline = line_.now().instant + 1h;
    command.done = [this](const WriteResult& result) { results_.push_back(result); };
    return command;
  }
  WriteCommand Reading(std::vector<std::uint32_t> points) {
    WriteCommand command = Command({});
    command.kind = Reads{std::move(points)};
    return command;
  }
  void Say(char kind, Bytes reply) {
    line_.twin(0).manner.instead = [kind, reply](View request) -> std::optional<Bytes> {
      return request[0] == kind ? std::optional(reply) : std::nullopt;
    };
  }
  std::uint32_t Count(WriteEnd end) const {
    return line_.StatusOf(0).writes.ends[static_cast<std::size_t>(end)];
  }

  // Points 0 and 1 are plain; point 2 needs an open session.
  VirtualLine line_{ToyLine({ToyDevice("a", "A", {"1", "2", "S3"})}), {&ToyProtocol()}};
  std::vector<WriteResult> results_;
};

TEST_F(PollerWriteEnd, AConfirmedWriteIsReadBack) {
  line_.Submit(Command({{0, 42.5}}));
  line_.RunFor(300ms);
  ASSERT_EQ(results_.size(), 1U);
  EXPECT_EQ(results_[0].end, WriteEnd::ok);
  EXPECT_TRUE(results_[0].read_back);
  EXPECT_EQ(results_[0].written, 1U);
  EXPECT_EQ(Count(WriteEnd::ok), 1U);
  EXPECT_EQ(line_.StatusOf(0).writes.not_read_back, 0U);
}

TEST_F(PollerWriteEnd, AConfirmedWriteWithAnotherValueReadBackDiffers) {
  line_.twin(0).manner.instead = [](View request) -> std::optional<Bytes> {
    if (request[2] != '1') return std::nullopt;
    return ToyReply(request[0] == 'W' ? "A1" : "A1=0");
  };
  line_.Submit(Command({{0, 42.5}}));
  line_.RunFor(300ms);
  ASSERT_EQ(results_.size(), 1U);
  EXPECT_EQ(results_[0].end, WriteEnd::differs);
  EXPECT_EQ(results_[0].reason,
            "p1 shows 0, although the device has confirmed that 42.5 was written");
  EXPECT_EQ(Count(WriteEnd::differs), 1U);
  EXPECT_EQ(line_.ValueOf(0, 0), Value(0.0)) << "the store shows what is";
}

TEST_F(PollerWriteEnd, AReadBackIsRepeatedWhenTheDeviceIsBusy) {
  int busy = 2;
  line_.twin(0).manner.instead = [&busy](View request) -> std::optional<Bytes> {
    if (request[2] != '1') return std::nullopt;
    if (request[0] == 'W') return ToyReply("A1");
    return ToyReply(busy-- > 0 ? "A1~busy" : "A1=0");
  };
  line_.Submit(Command({{0, 42.5}}));
  ASSERT_TRUE(line_.RunUntil([&] { return !results_.empty(); }, 400ms));
  EXPECT_EQ(results_[0].end, WriteEnd::differs);
}

TEST_F(PollerWriteEnd, APollAndAReadBackWaitForABusyDevice) {
  bool busy = true;
  line_.twin(0).manner.instead = [&busy](View request) -> std::optional<Bytes> {
    if (request[0] == 'W') return ToyReply("A1");
    if (request[0] != '?') return std::nullopt;
    const std::string tag(AsText(request).substr(1, 2));
    return ToyReply(tag + (busy ? "~busy" : "=0"));
  };
  ASSERT_TRUE(line_.RunUntil([&] { return line_.CountSent("?A1") > 0; }, 2s));
  line_.RunFor(30ms);
  line_.Submit(Command({{0, 42.5}}));
  ASSERT_TRUE(line_.RunUntil([&] { return line_.CountSent("?A1") > 1; }, 2s));
  line_.RunFor(30ms);
  busy = false;
  ASSERT_TRUE(line_.RunUntil([&] { return !results_.empty(); }, 400ms));
  EXPECT_EQ(results_[0].end, WriteEnd::differs);
}

TEST_F(PollerWriteEnd, AConfirmedWriteWithALostReadBackIsOk) {
  Say('?', {});
  line_.Submit(Command({{0, 42.5}}));
  ASSERT_TRUE(line_.RunUntil([&] { return !results_.empty(); }, 3s));
  EXPECT_EQ(results_[0].end, WriteEnd::ok) << "the device has said so";
  EXPECT_FALSE(results_[0].read_back);
  EXPECT_EQ(line_.StatusOf(0).writes.not_read_back, 1U);
}

TEST_F(PollerWriteEnd, AnUnansweredWriteIsUnknown) {
  Say('W', {});
  line_.Submit(Command({{0, 1.0}, {1, 2.0}}));
  ASSERT_TRUE(line_.RunUntil([&] { return !results_.empty(); }, 3s));
  EXPECT_EQ(results_[0].end, WriteEnd::unknown);
  EXPECT_EQ(results_[0].written, 0U);
  EXPECT_EQ(line_.CountSent("W"), 1U) << "not repeated, and the second not begun";
}

TEST_F(PollerWriteEnd, AnUnansweredPreparationLeavesTheWriteUnsent) {
  line_.Close();
  Say('O', {});
  line_.Open();
  line_.RunFor(1500ms);
  line_.Submit(Command({{2, 1.0}}));
  ASSERT_TRUE(line_.RunUntil([&] { return !results_.empty(); }, 3s));
  EXPECT_EQ(line_.CountSent("W"), 0U);
  EXPECT_NE(results_[0].end, WriteEnd::unknown);
  EXPECT_NE(results_[0].end, WriteEnd::ok);
}

TEST_F(PollerWriteEnd, TheResultCountsTheWritesBeforeARefusal) {
  line_.twin(0).manner.instead = [](View request) -> std::optional<Bytes> {
    if (request[0] != 'W' || request[2] != '2') return std::nullopt;
    return ToyReply("A2~refused");
  };
  line_.Submit(Command({{0, 1.0}, {1, 2.0}, {0, 3.0}}));
  line_.RunFor(500ms);
  ASSERT_EQ(results_.size(), 1U);
  EXPECT_EQ(results_[0].end, WriteEnd::refused);
  EXPECT_EQ(results_[0].written, 1U);
}

/// One set point is written every few milliseconds, so a read-back shows only the last write.
TEST_F(PollerWriteEnd, AStreamOfWritesToOnePointReportsNoDifference) {
  for (int i = 1; i <= 12; ++i) line_.Submit(Command({{0, i * 1.0}}));
  ASSERT_TRUE(line_.RunUntil([&] { return results_.size() == 12; }, 10s));
  for (const WriteResult& result : results_) EXPECT_EQ(result.end, WriteEnd::ok) << result.reason;
  EXPECT_EQ(Count(WriteEnd::ok), 12U);
  EXPECT_EQ(line_.ValueOf(0, 0), Value(12.0));
}

TEST_F(PollerWriteEnd, APointForbiddenAtTheLastMomentIsNotWritten) {
  WriteCommand command = Command({{0, 1.0}, {1, 2.0}});
  command.why_not = [this](Instant) {
    return line_.CountSent("WA1") > 0
               ? std::optional(Withheld{.end = WriteEnd::denied, .why = "interlock"})
               : std::nullopt;
  };
  line_.Submit(std::move(command));
  line_.RunFor(500ms);
  ASSERT_EQ(results_.size(), 1U);
  EXPECT_EQ(results_[0].end, WriteEnd::denied);
  EXPECT_EQ(results_[0].reason, "interlock");
  EXPECT_EQ(results_[0].written, 1U);
  EXPECT_EQ(line_.CountSent("WA1"), 1U);
  EXPECT_EQ(line_.CountSent("WA2"), 0U);
}

struct ForwardingSink final : CommandSink {
  explicit ForwardingSink(VirtualLine& to) : line(to) {}
  bool Submit(WriteCommand command) override {
    command.observers.emplace_back(
        [this](const WriteCommand& ended, const WriteResult&) { before.push_back(ended.before); });
    return line.Submit(std::move(command));
  }
  VirtualLine& line;
  std::vector<std::vector<Value>> before;
};

class TwoWriters : public PollerWriteEnd {
 protected:
  void SetUp() override {
    line_.twin(0).values.Set(0, Value(5.0));
    PollerWriteEnd::SetUp();
    config::Line line = *line_.store().LineAt(0);
    line.devices[0].points[0].writing.allowed = true;
    line_.store().Reconfigure(0, std::make_shared<const config::Line>(line));
  }
  void WriteExpecting(double value, const std::string& expect) {
    WriteAsk ask;
    ask.parts = {{.point = 0, .value = value, .expect = expect}};
    ask.deadline = line_.now().instant + 5s;
    ask.done = [this](const WriteResult& result) { results_.push_back(result); };
    gate_.Submit({"user:anna", 1}, std::move(ask), line_.now().instant);
  }

  ForwardingSink sink_{line_};
  WriteGate gate_{line_.store(), sink_};
};

TEST_F(TwoWriters, ThatExpectTheSameValueWriteOnce) {
  WriteExpecting(6, "5");
  WriteExpecting(7, "5");
  ASSERT_TRUE(line_.RunUntil([&] { return results_.size() == 2; }, 2s));
  EXPECT_EQ(results_[0].end, WriteEnd::ok);
  EXPECT_EQ(results_[1].end, WriteEnd::denied);
  EXPECT_TRUE(results_[1].changed);
  EXPECT_EQ(results_[1].reason, "'p1': the value has changed meanwhile to 6");
  EXPECT_EQ(line_.CountSent("WA1"), 1U);
  const std::vector<std::vector<Value>> before = {{5.0}, {6.0}};
  EXPECT_EQ(sink_.before, before) << "the values of the moment when each was due";
}

TEST_F(TwoWriters, AValueThatWasNotReadBackIsNotTheExpectedOne) {
  Say('?', {});
  WriteExpecting(6, "5");
  WriteExpecting(7, "5");
  ASSERT_TRUE(line_.RunUntil([&] { return results_.size() == 2; }, 5s));
  EXPECT_EQ(results_[1].end, WriteEnd::denied);
  EXPECT_EQ(line_.CountSent("WA1"), 1U);
}

TEST_F(PollerWriteEnd, AReadNowIsSentAtOnce) {
  line_.twin(0).values.Set(1, Value(7.0));
  line_.Submit(Reading({1}));
  line_.RunFor(100ms);
  ASSERT_EQ(results_.size(), 1U);
  EXPECT_TRUE(results_[0].read_back);
  ASSERT_EQ(line_.sent.size(), 1U);
  EXPECT_EQ(line_.sent[0].text, "?A2\r");
  EXPECT_EQ(line_.ValueOf(0, 1), Value(7.0));
  EXPECT_EQ(Count(WriteEnd::ok), 0U) << "it is no write";
}

TEST_F(PollerWriteEnd, AnUnansweredReadNowReportsAReason) {
  Say('?', {});
  line_.Submit(Reading({0, 1}));
  ASSERT_TRUE(line_.RunUntil([&] { return !results_.empty(); }, 5s));
  EXPECT_FALSE(results_[0].read_back);
  EXPECT_NE(results_[0].reason, "");
}

TEST_F(PollerWriteEnd, AReadNowOfAnOfflineDeviceFailsAtOnce) {
  line_.twin(0).manner.dead = true;
  line_.RunFor(10s);
  line_.Submit(Reading({0}));
  ASSERT_EQ(results_.size(), 1U) << "told at once";
  EXPECT_EQ(results_[0].reason, "the device is offline");
  line_.Close();
  line_.Submit(Reading({0}));
  ASSERT_EQ(results_.size(), 2U);
  EXPECT_FALSE(results_[1].read_back);
}

TEST(PollerWriteEndOfTwo, AWriteDoesNotWaitForTheReadBackOfAnotherDevice) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"}), ToyDevice("b", "B", {"1"})}),
                   {&ToyProtocol()});
  line.Open();
  line.RunFor(1500ms);
  line.twin(0).manner.instead = [](View request) -> std::optional<Bytes> {
    return request[0] == 'W' ? std::optional(Bytes()) : std::nullopt;
  };
  line.Write(0, 0, 1.0);
  line.Write(1, 0, 2.0);
  ASSERT_TRUE(line.RunUntil([&] { return line.ends.size() == 1; }, 2s));
  EXPECT_EQ(line.ends[0], WriteEnd::unknown);
  const Instant began = line.now().instant;
  ASSERT_TRUE(line.RunUntil([&] { return line.ends.size() == 2; }, 2s));
  EXPECT_EQ(line.ends[1], WriteEnd::ok);
  EXPECT_LT(line.now().instant - began, 200ms);
}

}  // namespace
}  // namespace baudgate::bus
