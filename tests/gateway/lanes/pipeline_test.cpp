// Who gets which reply, and what shows that a server is not up to several requests at a time.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/lanes/pipeline.h"

#include <gmock/gmock.h>

#include "gateway/base/text.h"

namespace baudgate {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

Bytes Message(std::uint16_t number, std::uint8_t unit, std::string_view pdu) {
  return modbus::AduOf(number, unit, *ParseHex(pdu));
}

class PipelineTest : public testing::Test {
 protected:
  PipelineTest() { pipeline_.OnOpened(); }

  /// Every lane has a unit of its own.
  static std::uint8_t UnitOf(std::size_t lane) { return static_cast<std::uint8_t>(10 + lane); }
  void Ask(std::size_t lane, std::uint16_t number = 1) {
    pipeline_.OnRequest(lane, Message(number, UnitOf(lane), "03 00 00 00 01"), now_);
    TakeSent();
  }
  void GiveUp(std::size_t lane) {
    pipeline_.OnNoReply(lane, now_);
    TakeSent();
  }
  void Pass(Duration time) {
    now_ += time;
    pipeline_.OnTimer(now_);
    TakeSent();
  }
  void TakeSent() {
    for (const Bytes& request : pipeline_.TakeOut()) sent_.push_back(request);
  }
  /// Answers the request that was sent as number `index`.
  std::vector<std::string> Answer(std::size_t index, std::string_view pdu = "03 02 00 07") {
    const Bytes& asked = sent_.at(index);
    return Hear(Message(*ByteReader(asked).U16Be(0), asked[6], pdu));
  }
  std::vector<std::string> Hear(View bytes) {
    std::vector<std::string> heard;
    for (const auto& [lane, message] : pipeline_.OnBytes(bytes, now_)) {
      heard.push_back(std::to_string(lane) + ": " + ToHex(message));
    }
    TakeSent();
    return heard;
  }
  /// What a server that answers only the first of two does to lane 1.
  void LoseTheSecond() {
    Ask(0);
    Ask(1);
    Answer(sent_.size() - 2);
    GiveUp(1);
    Ask(1);
    Answer(sent_.size() - 1);
    Pass(Pipeline::kApart);
  }

  Pipeline pipeline_{3};
  Instant now_ = Instant() + 1h;
  std::vector<Bytes> sent_;
};

TEST_F(PipelineTest, EveryRequestHasItsOwnNumberOnTheWay) {
  Ask(0);
  Ask(1);
  Ask(2);
  ASSERT_EQ(sent_.size(), 3U);
  EXPECT_EQ(ToHex(sent_[0]), "00 01 00 00 00 06 0A 03 00 00 00 01");
  EXPECT_EQ(ToHex(sent_[1]), "00 02 00 00 00 06 0B 03 00 00 00 01");
  EXPECT_EQ(ToHex(sent_[2]), "00 03 00 00 00 06 0C 03 00 00 00 01");
}

TEST_F(PipelineTest, RepliesInAnyOrderGoToWhoAsked) {
  Ask(0, 0x1234);
  Ask(1, 7);
  EXPECT_THAT(Answer(1), ElementsAre("1: 00 07 00 00 00 05 0B 03 02 00 07"));
  EXPECT_THAT(Answer(0), ElementsAre("0: 12 34 00 00 00 05 0A 03 02 00 07"));
  EXPECT_THAT(pipeline_.verdict(), IsEmpty());
}

TEST_F(PipelineTest, RepliesComeInPiecesAndTogether) {
  Ask(0);
  Ask(1);
  Bytes both = Message(1, 10, "03 02 00 07");
  Append(both, Message(2, 11, "83 02"));
  EXPECT_THAT(Hear(View(both).first(4)), IsEmpty());
  EXPECT_THAT(Hear(View(both).subspan(4, 9)), ElementsAre(StartsWith("0: ")));
  EXPECT_THAT(Hear(View(both).subspan(13)), ElementsAre("1: 00 01 00 00 00 03 0B 83 02"));
}

TEST_F(PipelineTest, ANumberThatNobodyAskedWithIsTheEnd) {
  Ask(0);
  Ask(1);
  EXPECT_THAT(Hear(Message(77, 10, "03 02 00 07")), IsEmpty());
  EXPECT_THAT(pipeline_.verdict(), HasSubstr("number that no request has"));
  EXPECT_THAT(Answer(0), IsEmpty()) << "nothing is handed over any more";
  Ask(2);
  EXPECT_EQ(sent_.size(), 2U) << "and nothing sent";
}

TEST_F(PipelineTest, SoIsAReplyOfAnotherUnit) {
  Ask(0);
  Ask(1);
  EXPECT_THAT(Hear(Message(1, 11, "03 02 00 07")), IsEmpty()) << "numbers mixed up";
  EXPECT_EQ(pipeline_.verdict(), "it answers a request to unit 10 as unit 11");
}

TEST_F(PipelineTest, SoIsWhatIsNoModbusTcp) {
  Ask(0);
  Hear(ToBytes("login: "));
  EXPECT_THAT(pipeline_.verdict(), HasSubstr("no Modbus TCP message"));
}

TEST_F(PipelineTest, ARepetitionHasTheNumberOfItsFirstTry) {
  Ask(0, 5);
  GiveUp(0);
  Ask(0, 5);
  ASSERT_EQ(sent_.size(), 2U);
  EXPECT_EQ(sent_[0], sent_[1]);
  Ask(0, 6);
  EXPECT_EQ(sent_[2][1], 2);
}

TEST_F(PipelineTest, ALateReplyIsHandedOverAsTheOldRequests) {
  Ask(0, 5);
  GiveUp(0);
  Ask(0, 6);
  EXPECT_THAT(Answer(0), ElementsAre(StartsWith("0: 00 05"))) << "which the lane passes over";
  EXPECT_THAT(Answer(1), ElementsAre(StartsWith("0: 00 06")));
  EXPECT_THAT(pipeline_.verdict(), IsEmpty()) << "it was alone";
}

TEST_F(PipelineTest, NumbersOfLongAgoAreForgottenAndNeverUsedTwiceAtATime) {
  Ask(1, 9);  // and never answered
  for (int i = 0; i < 70'000; ++i) {
    Ask(0, static_cast<std::uint16_t>(i));
    ASSERT_EQ(Answer(1).size(), 1U);
    sent_.pop_back();
    ASSERT_TRUE(pipeline_.verdict().empty()) << i;
  }
  EXPECT_THAT(Answer(0), ElementsAre(StartsWith("1: 00 09")));
}

TEST_F(PipelineTest, WhoIsSilentAmongOthersIsAskedAlone) {
  Ask(0);
  Ask(1);
  Answer(0);
  GiveUp(1);
  Ask(0, 2);
  Ask(1);
  EXPECT_EQ(sent_.size(), 3U) << "it waits for the reply under way";
  Ask(2);
  EXPECT_EQ(sent_.size(), 3U) << "and others for it";
  Answer(2);
  ASSERT_EQ(sent_.size(), 4U);
  EXPECT_EQ(sent_[3][6], 11);
  Answer(3);
  ASSERT_EQ(sent_.size(), 5U);
  EXPECT_EQ(sent_[4][6], 12);
  EXPECT_THAT(pipeline_.verdict(), IsEmpty()) << "once is nothing";
}

TEST_F(PipelineTest, AServerThatAnswersOnlyTheFirstIsFoundOut) {
  for (int i = 0; i < 2; ++i) LoseTheSecond();
  EXPECT_THAT(pipeline_.verdict(), IsEmpty());
  LoseTheSecond();
  EXPECT_EQ(pipeline_.verdict(), "unit 11 answers only when nothing else is asked");
}

TEST_F(PipelineTest, SignsOfLongAgoDoNotCount) {
  for (int i = 0; i < 10; ++i) {
    LoseTheSecond();
    Pass(6min);
  }
  EXPECT_THAT(pipeline_.verdict(), IsEmpty());
}

TEST_F(PipelineTest, OneHiccupIsOneSign) {
  for (std::size_t lane = 0; lane < 3; ++lane) Ask(lane);
  for (std::size_t lane = 0; lane < 3; ++lane) GiveUp(lane);
  for (std::size_t lane = 0; lane < 3; ++lane) Answer(lane);
  EXPECT_THAT(pipeline_.verdict(), IsEmpty());
}

TEST_F(PipelineTest, AnAbsentUnitIsNoSignAndHoldsUpOthersShortly) {
  Ask(0);
  Ask(1);
  Answer(0);
  GiveUp(1);
  Ask(1);  // alone
  Ask(0, 2);
  EXPECT_EQ(sent_.size(), 3U);
  ASSERT_EQ(pipeline_.Deadline(), now_ + Pipeline::kAlone);
  Pass(Pipeline::kAlone);
  EXPECT_EQ(sent_.size(), 4U);
  Answer(3);
  GiveUp(1);
  for (std::uint16_t i = 3; i < 100; ++i) {
    Ask(0, i);
    Ask(1);
    EXPECT_EQ(sent_.size(), 4U + 2U * (i - 2)) << "it is not asked alone any more";
    Answer(sent_.size() - 2);
    GiveUp(1);
    Pass(Pipeline::kApart);
  }
  EXPECT_THAT(pipeline_.verdict(), IsEmpty());
}

TEST_F(PipelineTest, AnAbsentUnitThatIsBackIsJudgedAgain) {
  Ask(0);
  Ask(1);
  Answer(0);
  GiveUp(1);
  Ask(1);
  GiveUp(1);  // silent when alone, too
  Ask(1);
  Answer(sent_.size() - 1);
  for (int i = 0; i < 3; ++i) LoseTheSecond();
  EXPECT_THAT(pipeline_.verdict(), HasSubstr("answers only when"));
}

TEST_F(PipelineTest, RepliesThatComeTooLateAmongOthersAreSigns) {
  for (int i = 0; i < 3; ++i) {
    EXPECT_THAT(pipeline_.verdict(), IsEmpty());
    const std::size_t first = sent_.size();
    Ask(0, static_cast<std::uint16_t>(i));
    Ask(1, static_cast<std::uint16_t>(i));
    Answer(first);
    GiveUp(1);
    Answer(first + 1);
    Pass(Pipeline::kApart);
  }
  EXPECT_THAT(pipeline_.verdict(), HasSubstr("too late"));
}

TEST_F(PipelineTest, BusyAmongOthersAndNotAloneIsASign) {
  for (int i = 0; i < 3; ++i) {
    EXPECT_THAT(pipeline_.verdict(), IsEmpty());
    const std::size_t first = sent_.size();
    const auto number = static_cast<std::uint16_t>(2 * i);
    Ask(0, number);
    Ask(1, number);
    Answer(first + 1, "83 06");
    Answer(first);
    Ask(1, static_cast<std::uint16_t>(number + 1));
    Answer(first + 2);
    Pass(Pipeline::kApart);
  }
  EXPECT_THAT(pipeline_.verdict(), HasSubstr("unit 11"));
}

TEST_F(PipelineTest, ADeviceThatIsBusyByItselfIsNone) {
  for (std::uint16_t i = 0; i < 20; ++i) {
    const std::size_t first = sent_.size();
    Ask(0, i);
    Ask(1, i);
    Answer(first, "83 06");
    Answer(first + 1);
    Ask(0, static_cast<std::uint16_t>(i + 100));
    Answer(first + 2, "83 06");
    Pass(Pipeline::kApart);
  }
  EXPECT_THAT(pipeline_.verdict(), IsEmpty());
}

TEST_F(PipelineTest, ConnectionsThatEndUnderSeveralRequestsAreSigns) {
  for (int i = 0; i < 3; ++i) {
    EXPECT_THAT(pipeline_.verdict(), IsEmpty());
    Ask(0);
    Ask(1);
    pipeline_.OnLost(now_);
    pipeline_.OnOpened();
  }
  EXPECT_THAT(pipeline_.verdict(), HasSubstr("closes the connection"));
}

TEST_F(PipelineTest, ThoseThatEndUnderOneAreNot) {
  for (int i = 0; i < 10; ++i) {
    Ask(0);
    Ask(1);
    Answer(sent_.size() - 1);
    pipeline_.OnLost(now_);
    pipeline_.OnOpened();
  }
  EXPECT_THAT(pipeline_.verdict(), IsEmpty());
}

TEST_F(PipelineTest, WhatWaitsAndIsGivenUpIsNeverSent) {
  Ask(0);
  Ask(1);
  Answer(0);
  GiveUp(1);
  Ask(0, 2);
  Ask(1);  // waits for lane 0, to be alone
  Ask(2);  // waits for lane 1
  GiveUp(2);
  GiveUp(1);
  Answer(2);
  Pass(10s);
  EXPECT_EQ(sent_.size(), 3U);
}

TEST_F(PipelineTest, AWriteWaitsForNobody) {
  Ask(0);
  Ask(1);
  Answer(0);
  GiveUp(1);
  Ask(1);  // alone
  pipeline_.OnRequest(2, Message(9, UnitOf(2), "06 00 01 00 07"), now_);
  TakeSent();
  ASSERT_EQ(sent_.size(), 4U);
  EXPECT_EQ(sent_[3][7], 6);
  Ask(0, 2);
  EXPECT_EQ(sent_.size(), 5U) << "nobody is alone any more";
  Answer(2);
  EXPECT_THAT(pipeline_.verdict(), IsEmpty());
}

TEST_F(PipelineTest, RepliesToAnotherConnectionsRequestsAreNobodys) {
  Ask(0);
  pipeline_.OnOpened();
  EXPECT_THAT(Answer(0), IsEmpty());
  EXPECT_FALSE(pipeline_.verdict().empty());
}

}  // namespace
}  // namespace baudgate
