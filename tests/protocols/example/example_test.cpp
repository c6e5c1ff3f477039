// Tests the protocol of protocols/example, the guide to new protocols: its codec, its checks, and
// its conversation with its simulated device.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/base/text.h"
#include "protocols/example/codec.h"
#include "protocols/example/protocol.h"
#include "protocols/example/rules.h"
#include "tests/laws/frame_rule_laws.h"
#include "tests/support/talk.h"

namespace baudgate::protocols {
namespace {

config::Point Item(const char* read) {
  config::Point point;
  point.name = "item";
  point.read = read;
  point.access = config::Access::read_write;
  return point;
}

config::Device ExampleDevice() { return DeviceOf(ExampleProtocol(), "A", {Item("7"), Item("12")}); }

class Example : public ::testing::Test {
 protected:
  Example() {
    values_.Set(0, 5.0);
    values_.Set(1, -0.25);
  }

  Answer Run(const Task& task) { return talk_.Run(task, *twin_); }

  const config::Device device_ = ExampleDevice();
  FixedValues values_;
  std::unique_ptr<Twin> twin_ = ExampleProtocol().make_twin(device_, values_);
  Talk talk_{ExampleProtocol(), device_};
};

TEST_F(Example, ReadsEveryPoint) {
  ASSERT_EQ(talk_->Queries().size(), 2U);
  const Answer first = Run(Poll(0));
  ASSERT_EQ(first.readings.size(), 1U);
  EXPECT_EQ(first.readings[0].point, 0U);
  EXPECT_EQ(first.readings[0].value, Value(5.0));
  EXPECT_EQ(Run(Poll(1)).readings.at(0).value, Value(-0.25));
}

TEST_F(Example, WritesAndReadsBack) {
  EXPECT_EQ(Run(Write(1, 2.5)).outcome, Outcome::ok);
  EXPECT_EQ(Run(Poll(1)).readings.at(0).value, Value(2.5));
}

TEST_F(Example, IsProbedByItsType) {
  const auto request = talk_.Ask(Probe());
  EXPECT_EQ(AsText(request->bytes), "?A0\r");
  EXPECT_TRUE(request->steady);
  EXPECT_EQ(Run(Probe()).outcome, Outcome::ok);
}

TEST_F(Example, AReplyToAnotherRequestGivesNoReadings) {
  for (const char* reply : {"B7", "A8"}) {
    const Bytes frame = protocols::example::EncodeReply(
        {'!', reply[0], static_cast<unsigned>(reply[1] - '0'), "=5"});
    const Answer answer = talk_->Interpret(ToBytes("?A7\r"), frame);
    EXPECT_EQ(answer.outcome, Outcome::unexpected) << reply;
    EXPECT_TRUE(answer.readings.empty());
  }
}

TEST_F(Example, AnUnknownItemIsRefused) {
  const Bytes reply = twin_->Answer(ToBytes("?A99\r"), {});
  EXPECT_EQ(AsText(reply).substr(0, 5), "!A99~");
  EXPECT_EQ(talk_->Interpret(ToBytes("?A99\r"), reply).outcome, Outcome::unsupported);
  EXPECT_TRUE(twin_->Answer(ToBytes("?B7\r"), {}).empty()) << "another device is asked";
}

TEST_F(Example, RepliesMatchTheGuide) {
  EXPECT_EQ(AsText(twin_->Answer(ToBytes("?A7\r"), {})), "!A7=5*0B\r");
  EXPECT_EQ(AsText(protocols::example::EncodeReply({'!', 'A', 7, "~"})), "!A7~*17\r");
}

TEST_F(Example, AReplyOfAnotherDeviceIsUnexpected) {
  twin_->ReplyAs("B");
  EXPECT_EQ(AsText(twin_->Answer(ToBytes("?A7\r"), {})).substr(0, 5), "!B7=5");
  EXPECT_TRUE(twin_->Answer(ToBytes("?B7\r"), {}).empty()) << "it is still called A";
  EXPECT_EQ(Run(Poll(0)).outcome, Outcome::unexpected);
}

TEST_F(Example, ChecksAddressesAndPoints) {
  EXPECT_TRUE(ExampleProtocol().canonical_address("Q"));
  EXPECT_FALSE(ExampleProtocol().canonical_address("a"));
  EXPECT_TRUE(ExampleProtocol().check_point(Item("999")));
  EXPECT_FALSE(ExampleProtocol().check_point(Item("0")));
}

using ::testing::ValuesIn;

std::vector<LawSubject> Subjects() {
  namespace example = protocols::example;
  const auto noise = [](std::mt19937& random) {
    constexpr std::string_view kNoise = "A7=5*0B~\x01\x80";
    Bytes bytes(random() % 40);
    for (std::uint8_t& byte : bytes) {
      byte = static_cast<std::uint8_t>(kNoise[random() % kNoise.size()]);
    }
    return bytes;
  };
  LawSubject replies;
  replies.name = "Replies";
  replies.rule = example::ReplyRule;
  replies.expect.max_bytes = example::kMaxFrame;
  replies.frames = {example::EncodeReply({'!', 'A', 7, "=5"}),
                    example::EncodeReply({'!', 'Z', 999, "=-12.75"}),
                    example::EncodeReply({'!', 'A', 7, "~"})};
  replies.garbage = noise;
  LawSubject requests = replies;
  requests.name = "Requests";
  requests.rule = example::RequestRule;
  requests.frames = {example::EncodeRequest({'?', 'A', 7, {}}),
                     example::EncodeRequest({'W', 'A', 7, "=5"})};
  requests.checksum = false;
  return {replies, requests};
}

INSTANTIATE_TEST_SUITE_P(Example, FrameRuleLaws, ValuesIn(Subjects()), LawSubjectName);
INSTANTIATE_TEST_SUITE_P(Example, ChecksumLaws, ValuesIn(WithChecksum(Subjects())), LawSubjectName);
INSTANTIATE_TEST_SUITE_P(Example, GarbageLaws, ValuesIn(FoundBehindGarbage(Subjects())),
                         LawSubjectName);

}  // namespace
}  // namespace baudgate::protocols
