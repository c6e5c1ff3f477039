// Requests and replies against the worked examples of the SPA Bus reference, and what is refused.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/codec.h"

#include "protocols/spabus/reply.h"
#include "protocols/spabus/rules.h"
#include "tests/protocols/spabus/support.h"

namespace baudgate::protocols::spabus {
namespace {

std::string Text(View bytes) { return std::string(AsText(bytes)); }

Expectation Accepting(int bits) {
  Expectation expect;
  expect.max_bytes = kMaxReply;
  expect.checksum = bits;
  return expect;
}

TEST(SpaRequest, WorkedExamplesOfTheReference) {
  const Address identification{0, 'F', {}};
  EXPECT_EQ(ToHex(Encode(ReadOf(1, identification, 0), false)), "3E 31 52 46 3A 32 31 0D");
  EXPECT_EQ(Text(Encode(ReadOf(2, {0, 'I', 1}, 5), false)), ">2RI1/5:06\r");
  EXPECT_EQ(Text(Encode(ReadOf(1, {0, 'L', {}}, 0), false)), ">1RL:2B\r");
  EXPECT_EQ(Text(Encode(ReadOf(1, {0, 'B', {}}, 0), false)), ">1RB:25\r");
  EXPECT_EQ(Text(Encode(WriteOf(1, {0, 'C', {}}, "0"), false)), ">1WC:0:2B\r");
  EXPECT_EQ(Text(Encode(WriteOf(900, {0, 'T', {}}, "12.345"), false)), ">900WT:12.345:1B\r");
  EXPECT_EQ(Text(Encode(WriteOf(900, {0, 'D', {}}, "24-02-29 23.59;58.125"), false)),
            ">900WD:24-02-29 23.59;58.125:36\r");
  EXPECT_EQ(Text(Encode(WriteOf(1, {0, 'V', 160}, "1"), false)), ">1WV160:1:08\r");
}

TEST(SpaRequest, ChannelIsWrittenUnlessItIsZero) {
  EXPECT_TRUE(Text(Encode(ReadOf(1, {14, 'V', 1}, 1), false)).starts_with(">1R14V1:"));
  EXPECT_EQ(Text(Encode(ReadOf(1, {14, 'V', 1}, 1), true)), ">1R14V1:XX\r");
}

TEST(SpaRequest, ReadsBackWhatItWrites) {
  for (const Command& command : {ReadOf(2, {0, 'I', 1}, 5), ReadOf(899, {14, 'V', 1}, 1),
                                 ReadOf(1, {3, 'A', {}}, 0), WriteOf(7, {0, 'S', 21}, "0.5")}) {
    const ReceivedRequest got = ParseRequest(Encode(command, false));
    EXPECT_TRUE(got.intact);
    ASSERT_TRUE(got.command);
    EXPECT_EQ(*got.command, command);
  }
}

TEST(SpaRequest, KnowsWhereTheDataStands) {
  const ReceivedRequest got = ParseRequest(ToBytes(">12WV160:345:XX\r"));
  ASSERT_TRUE(got.command);
  EXPECT_EQ(got.command->data, "345");
  EXPECT_EQ(got.data_at, 9U);
}

TEST(SpaRequest, TellsDamageFromSyntax) {
  EXPECT_FALSE(ParseRequest(ToBytes(">1RF:22\r")).intact);
  EXPECT_TRUE(ParseRequest(ToBytes(">1RF:XX\r")).intact);
  EXPECT_FALSE(ParseRequest(ToBytes("1RF:21\r")).slave);
  EXPECT_FALSE(ParseRequest(ToBytes(">1234RF:XX\r")).slave);
  for (const char* wrong :
       {">1QF:XX\r", ">1RZ1:XX\r", ">1RI:XX\r", ">1RF1:XX\r", ">1RI5/1:XX\r", ">1RI1234567:XX\r",
        ">1WV1:XX\r", ">1R:XX\r", ">1R1234I1:XX\r", ">1WV1:1:2:XX\r", ">1RI1/:XX\r"}) {
    const ReceivedRequest got = ParseRequest(ToBytes(wrong));
    EXPECT_TRUE(got.intact) << wrong;
    EXPECT_FALSE(got.command) << wrong;
  }
}

TEST(SpaReply, ChecksumsOfTheReference) {
  for (const auto& [covered, checksum] :
       std::map<std::string, std::string>{{"<1D:0.52/0.49/0.51/0.00/0:", "77"},
                                          {"<1D:SPCJ 4D29:", "18"},
                                          {"<1A:", "76"},
                                          {"<1N:5:", "76"},
                                          {"<1D::", "49"}}) {
    EXPECT_EQ(MatchingReadings(Sealed(covered, checksum), false), kCoversAny) << covered;
    EXPECT_EQ(MatchingReadings(Sealed(covered, checksum), true), 0) << covered;
  }
}

TEST(SpaReply, ContinuedExampleMatchesOneReadingEach) {
  const std::string covered = "<3D:1.00/2.00/3.0&\r\n0/4.00/5.00:";
  EXPECT_EQ(MatchingReadings(Sealed(covered, "75"), false), kCoversAll);
  EXPECT_EQ(MatchingReadings(Sealed(covered, "72"), false), kCoversNoLineEnds);
  EXPECT_EQ(MatchingReadings(Sealed(covered, "54"), false), kCoversCharacters);
  EXPECT_EQ(MatchingReadings(Sealed(covered, "0B"), false), kCoversLastLine);
  EXPECT_EQ(MatchingReadings(Sealed(covered, "74"), false), 0);
  const auto reply = ParseReply(Sealed(covered, "75"));
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->data, "1.00/2.00/3.00/4.00/5.00");
  EXPECT_TRUE(reply->continued);
}

TEST(SpaReply, LineFeedChangesTheChecksumByItsCode) {
  EXPECT_EQ(MatchingReadings(Sealed("<1A:", "7C"), true), kCoversAny);
  EXPECT_EQ(Text(EncodeAck(1, kCoversAll | kLineFeedCovered)), "\n<1A:7C\r\n");
  EXPECT_EQ(Text(EncodeAck(1, kCoversAll)), "\n<1A:76\r\n");
}

TEST(SpaReply, NackCodeIsTheFirstDigitWhateverTheLayout) {
  for (const char* text : {"<1N:5:XX\r", "<1N5:XX\r", "<1N: 5:XX\r", "<1N:E5 blocked:XX\r"}) {
    const auto reply = ParseReply(ToBytes(text));
    ASSERT_TRUE(reply) << text;
    EXPECT_EQ(reply->type, 'N');
    EXPECT_EQ(reply->nack, 5) << text;
  }
  EXPECT_EQ(ParseReply(ToBytes("<1N::XX\r"))->nack, std::nullopt);
}

TEST(SpaReply, LetterNInDataIsNoNack) {
  const auto reply = ParseReply(ToBytes("<1D:NONE 5:XX\r"));
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->type, 'D');
  EXPECT_FALSE(reply->nack);
}

TEST(SpaReply, WrongSyntaxIsNoReply) {
  for (const char* wrong : {"<D:1:XX\r", "<1234D:1:XX\r", "<1D1:XX\r", "<1D:1XX\r", "<1A:1:XX\r",
                            "<1Q:XX\r", "<1D:1:2:XX\r", "<1D:1:GG\r", "<1D:1:XX:XX\r", "<1D:XX\r",
                            "<1A&\r\n:XX\r", "<1\r", "<1D:1&2:XX\r"}) {
    EXPECT_FALSE(ParseReply(ToBytes(wrong))) << wrong;
  }
}

TEST(SpaReply, LongDataIsContinuedWithinLinesOf255) {
  const std::string data(700, '7');
  for (const int reading : {kCoversAll, kCoversNoLineEnds, kCoversCharacters, kCoversLastLine}) {
    const auto frame = EncodeData(1, data, reading);
    ASSERT_TRUE(frame);
    const std::string sent = Text(*frame);
    for (const auto line : Split(sent, '\n')) EXPECT_LE(line.size(), kMaxLine + 1);
    const View text = View(*frame).subspan(1);
    EXPECT_EQ(ParseReply(text)->data, data);
    EXPECT_TRUE(ChecksumPasses(text, reading));
  }
  EXPECT_FALSE(EncodeData(1, std::string(5000, '7'), kCoversAll)) << "more than 16 lines";
}

TEST(SpaReply, EveryLengthAroundTheLineEndSurvives) {
  for (std::size_t length = 245; length <= 260; ++length) {
    const auto frame = EncodeData(1, std::string(length, '1'), kCoversAll);
    const auto frames = Cut(ReplyRule, Accepting(kCoversAll), *frame);
    ASSERT_EQ(frames.size(), 1U) << length;
    EXPECT_EQ(ParseReply(frames[0])->data.size(), length);
  }
}

TEST(SpaReplyRule, EchoIsDroppedWithoutBlame) {
  Assembler assembler;
  assembler.Begin(ReplyRule, Accepting(kCoversAny));
  assembler.Feed(ToBytes(">1RF:21\r\n<1D:SPCJ 4D29:18\r\n"));
  EXPECT_EQ(Text(*assembler.Next(false)), "<1D:SPCJ 4D29:18\r\n");
  EXPECT_EQ(assembler.blame(), Outcome::none);

  assembler.Begin(ReplyRule, Accepting(kCoversAny));
  assembler.Feed(ToBytes(">1RF:21\r"));
  EXPECT_FALSE(assembler.Next(true));
  EXPECT_EQ(assembler.blame(), Outcome::none) << "an echo alone is no reply, and no damage";
}

TEST(SpaReplyRule, BlamesWhatWentWrong) {
  const auto blame = [](const std::string& stream) {
    Assembler assembler;
    assembler.Begin(ReplyRule, Accepting(kCoversAny));
    assembler.Feed(ToBytes(stream));
    EXPECT_FALSE(assembler.Next(true)) << stream;
    return assembler.blame();
  };
  EXPECT_EQ(blame("\n<1D:SPCJ 4D29:19\r\n"), Outcome::corrupt);
  EXPECT_EQ(blame("\n<1D:SPCJ"), Outcome::partial);
  EXPECT_EQ(blame("\n"), Outcome::none);
  EXPECT_EQ(blame("garbage"), Outcome::partial);
  EXPECT_EQ(blame("<1D:SP\x80J:18\r\n"), Outcome::corrupt);
  EXPECT_EQ(blame("<1D:SPCJ 4D29:XX\r\n"), Outcome::corrupt) << "XX is not accepted here";
}

TEST(SpaReplyRule, WildcardAndMissingLineFeedsAreTaken) {
  const auto frames =
      Cut(ReplyRule, Accepting(kCoversAny | kWildcardAccepted), ToBytes("<1D: SPAJ 142C:XX\r"));
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_TRUE(ParseReply(frames[0])->wildcard);
}

TEST(SpaReplyRule, BoundsLinesAndTheirNumber) {
  const auto frames = [](const std::string& covered) {
    return Cut(ReplyRule, Accepting(kCoversAny), ReplyText(covered)).size();
  };
  EXPECT_EQ(frames("<1D:" + std::string(248, '1') + ":"), 1U);
  EXPECT_EQ(frames("<1D:" + std::string(249, '1') + ":"), 1U) << "256, before version 2.1";
  EXPECT_EQ(frames("<1D:" + std::string(250, '1') + ":"), 0U) << "257 characters in a line";
  std::string lines = "<1D:";
  for (int i = 1; i < 16; ++i) lines += "1&\r\n";
  EXPECT_EQ(frames(lines + ":"), 1U);
  EXPECT_EQ(frames(lines + "1&\r\n:"), 0U) << "17 lines";
}

TEST(SpaReplyRule, PinnedReadingRefusesTheOthers) {
  const Bytes frame = Sealed("<3D:1.00/2.00/3.0&\r\n0/4.00/5.00:", "72");
  EXPECT_EQ(Cut(ReplyRule, Accepting(kCoversNoLineEnds), frame).size(), 1U);
  EXPECT_EQ(Cut(ReplyRule, Accepting(kCoversAll), frame).size(), 0U);
}

TEST(SpaAddress, ReadsAndPrintsTheForms) {
  for (const char* text : {"I1", "14V1", "F", "C", "V205", "3A", "T", "D", "M0", "O999999"}) {
    const auto address = ParseAddress(text);
    ASSERT_TRUE(address) << text;
    EXPECT_EQ(FormatAddress(*address), text);
  }
  EXPECT_EQ(*ParseAddress("0I1"), *ParseAddress("I01"));
}

TEST(SpaAddress, RefusesWithWhatWouldBeRight) {
  for (const char* text : {"", "1", "I", "i1", "Z1", "F1", "I1/5", "I1 ", "1000I1", "V1234567"}) {
    const auto address = ParseAddress(text);
    ASSERT_FALSE(address) << text;
    EXPECT_NE(address.error().find("such as I1"), std::string::npos) << address.error();
  }
}

}  // namespace
}  // namespace baudgate::protocols::spabus
