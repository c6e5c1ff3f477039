// Tests that the frame rules for DCON requests and replies keep the laws in protocols/frame_rule.h,
// with every checksum variant.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/codec.h"
#include "protocols/dcon/rules.h"
#include "tests/laws/frame_rule_laws.h"

namespace baudgate::protocols {
namespace {

using protocols::dcon::BuildReply;
using protocols::dcon::BuildRequest;

/// Returns noise, truncated lines and foreign text. It has no CR, so it contains no whole frame.
Bytes Garbage(std::mt19937& random, std::string_view starts) {
  constexpr std::string_view kText = "0123456789ABCDEF+-. \n";
  Bytes bytes(random() % 40);
  for (std::uint8_t& byte : bytes) {
    const auto kind = random() % 8;
    if (kind == 0) {
      byte = static_cast<std::uint8_t>(starts[random() % starts.size()]);
    } else if (kind == 1) {
      byte = static_cast<std::uint8_t>(random());
    } else {
      byte = static_cast<std::uint8_t>(kText[random() % kText.size()]);
    }
    if (byte == '\r') byte = 0;
  }
  return bytes;
}

Expectation Expecting(int variant) {
  Expectation expect;
  expect.max_bytes = protocols::dcon::kMaxFrame;
  expect.checksum = variant;
  return expect;
}

/// Returns lead and text without the checksum, because its digits can have either case.
Bytes Meaning(View frame, int variant) {
  const auto reply = protocols::dcon::ParseReply(frame, variant);
  return reply ? ToBytes(std::string(1, reply->lead) + reply->body) : Bytes{};
}

Bytes RequestMeaning(View frame) {
  const auto request = protocols::dcon::ParseRequest(frame, true);
  return request ? ToBytes(request->text + HexByte(request->address)) : Bytes{};
}

LawSubject Requests(bool checksum) {
  LawSubject subject;
  subject.name = checksum ? "RequestsWithChecksum" : "Requests";
  subject.rule = protocols::dcon::RequestRule;
  subject.expect = Expecting(checksum ? protocols::dcon::kChecksum : protocols::dcon::kNoChecksum);
  for (const std::string_view command :
       {"#", "#7", "$6", "$M", "@3C", "#1301", "#2+07.500", "~0"}) {
    subject.frames.push_back(BuildRequest(command, 0x4A, checksum));
  }
  subject.garbage = [](std::mt19937& random) { return Garbage(random, "$#%@~^"); };
  subject.checksum = checksum;
  if (checksum) subject.essence = RequestMeaning;
  return subject;
}

LawSubject Replies(std::string name, int variant) {
  const bool checksum = variant != protocols::dcon::kNoChecksum;
  LawSubject subject;
  subject.name = std::move(name);
  subject.rule = protocols::dcon::ReplyRule;
  subject.expect = Expecting(variant);
  for (const std::string_view text :
       {">+100.23+34.050+124.56+07.331-101.45+1038.9-50.501+05.880", ">7FFF800000004000", "!2A1500",
        "!0B7060", "!01200600", ">-02.471", "?0A", ">"}) {
    subject.frames.push_back(BuildReply(text, checksum));
  }
  if (variant == protocols::dcon::kChecksumEither || variant == protocols::dcon::kChecksumFront) {
    subject.frames.push_back(protocols::dcon::BuildCounterReplyFront("0000001E"));
  }
  subject.garbage = [](std::mt19937& random) { return Garbage(random, ">!?"); };
  subject.checksum = checksum;
  if (checksum) subject.essence = [variant](View frame) { return Meaning(frame, variant); };
  return subject;
}

std::vector<LawSubject> Subjects() {
  return {Requests(false),
          Requests(true),
          Replies("Replies", protocols::dcon::kNoChecksum),
          Replies("RepliesWithChecksum", protocols::dcon::kChecksum),
          Replies("RepliesWithChecksumEither", protocols::dcon::kChecksumEither),
          Replies("RepliesWithChecksumFront", protocols::dcon::kChecksumFront)};
}

using ::testing::ValuesIn;
INSTANTIATE_TEST_SUITE_P(Dcon, FrameRuleLaws, ValuesIn(Subjects()), LawSubjectName);
INSTANTIATE_TEST_SUITE_P(Dcon, ChecksumLaws, ValuesIn(WithChecksum(Subjects())), LawSubjectName);
INSTANTIATE_TEST_SUITE_P(Dcon, GarbageLaws, ValuesIn(FoundBehindGarbage(Subjects())),
                         LawSubjectName);

Outcome Blame(std::string_view stream, int variant) {
  Assembler assembler;
  assembler.Begin(protocols::dcon::ReplyRule, Expecting(variant));
  assembler.Feed(ToBytes(stream));
  EXPECT_FALSE(assembler.Next(true).has_value()) << stream;
  return assembler.blame();
}

TEST(DconReplyRule, DistinguishesChecksumErrorsCutsAndNoise) {
  EXPECT_EQ(Blame(">+05.88023\r", protocols::dcon::kChecksum), Outcome::corrupt);
  EXPECT_EQ(Blame(">+05.880", protocols::dcon::kChecksum), Outcome::partial);
  EXPECT_EQ(Blame(std::string_view("\0\xFF\n", 3), protocols::dcon::kChecksum), Outcome::none);
  EXPECT_EQ(Blame("05.880\r", protocols::dcon::kNoChecksum), Outcome::partial);
  EXPECT_EQ(Blame(">+05\x80", protocols::dcon::kNoChecksum), Outcome::corrupt);
}

TEST(DconReplyRule, AnEchoOfTheRequestIsSkipped) {
  Assembler assembler;
  assembler.Begin(protocols::dcon::ReplyRule, Expecting(protocols::dcon::kChecksum));
  assembler.Feed(ToBytes("#0184\r>+100.23+34.050E2\r"));
  const auto frame = assembler.Next(false);
  ASSERT_TRUE(frame.has_value());
  EXPECT_EQ(AsText(*frame), ">+100.23+34.050E2\r");
}

TEST(DconReplyRule, ATextMayHoldAStartCharacterWhenTheChecksumFits) {
  Assembler assembler;
  assembler.Begin(protocols::dcon::ReplyRule, Expecting(protocols::dcon::kChecksum));
  const Bytes name = BuildReply("!01A>B", true);
  assembler.Feed(name);
  EXPECT_EQ(assembler.Next(false), std::optional(name));
}

TEST(DconReplyRule, TheReplyAfterAnIncompleteReplyIsFound) {
  for (const int variant : {protocols::dcon::kNoChecksum, protocols::dcon::kChecksum}) {
    Assembler assembler;
    assembler.Begin(protocols::dcon::ReplyRule, Expecting(variant));
    const Bytes whole = BuildReply("!01200600", variant != protocols::dcon::kNoChecksum);
    assembler.Feed(ToBytes(">+100.23+3"));
    assembler.Feed(whole);
    EXPECT_EQ(assembler.Next(false), std::optional(whole)) << variant;
  }
}

TEST(DconReplyRule, AnOverlongFrameIsDiscarded) {
  Assembler assembler;
  assembler.Begin(protocols::dcon::ReplyRule, Expecting(protocols::dcon::kNoChecksum));
  assembler.Feed(ToBytes(">" + std::string(protocols::dcon::kMaxFrame - 2, '0')));
  EXPECT_FALSE(assembler.Next(false).has_value());
  EXPECT_EQ(assembler.held(), protocols::dcon::kMaxFrame - 1);
  assembler.Feed(ToBytes("0"));
  EXPECT_FALSE(assembler.Next(false).has_value());
  EXPECT_EQ(assembler.held(), 0U);
  EXPECT_EQ(assembler.blame(), Outcome::corrupt);
}

TEST(DconReplyRule, AnOverlongTextGivesTheSameOutcomeAtEveryCut) {
  for (const std::size_t start :
       {std::size_t{10}, protocols::dcon::kMaxFrame - 1, protocols::dcon::kMaxFrame + 10}) {
    std::string stream = ">" + std::string(2 * protocols::dcon::kMaxFrame, '0');
    stream[start] = '>';
    stream[stream.size() - 5] = '>';
    Assembler bytewise;
    bytewise.Begin(protocols::dcon::ReplyRule, Expecting(protocols::dcon::kNoChecksum));
    for (const char character : stream) {
      bytewise.Feed(ToBytes(std::string(1, character)));
      EXPECT_FALSE(bytewise.Next(false).has_value());
    }
    EXPECT_FALSE(bytewise.Next(true).has_value());
    EXPECT_EQ(bytewise.blame(), Blame(stream, protocols::dcon::kNoChecksum)) << start;
  }
}

}  // namespace
}  // namespace baudgate::protocols
