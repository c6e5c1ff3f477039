// Tests requests and replies with examples of the SPA Bus reference, and rejected frames.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/codec.h"

#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>

#include "gateway/base/text.h"
#include "protocols/spabus/conversation.h"
#include "protocols/spabus/points.h"
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

TEST(SpaRequest, MatchesTheWorkedExamplesOfTheReference) {
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

TEST(SpaRequest, HasAChannelUnlessItIsZero) {
  EXPECT_TRUE(Text(Encode(ReadOf(1, {14, 'V', 1}, 1), false)).starts_with(">1R14V1:"));
  EXPECT_EQ(Text(Encode(ReadOf(1, {14, 'V', 1}, 1), true)), ">1R14V1:XX\r");
}

TEST(SpaRequest, IsEncodedAndDecoded) {
  for (const Command& command : {ReadOf(2, {0, 'I', 1}, 5), ReadOf(899, {14, 'V', 1}, 1),
                                 ReadOf(1, {3, 'A', {}}, 0), WriteOf(7, {0, 'S', 21}, "0.5")}) {
    const ReceivedRequest got = ParseRequest(Encode(command, false));
    EXPECT_TRUE(got.intact);
    ASSERT_TRUE(got.command);
    EXPECT_EQ(*got.command, command);
  }
}

TEST(SpaRequest, ReportsThePositionOfItsData) {
  const ReceivedRequest got = ParseRequest(ToBytes(">12WV160:345:XX\r"));
  ASSERT_TRUE(got.command);
  EXPECT_EQ(got.command->data, "345");
  EXPECT_EQ(got.data_at, 9U);
}

TEST(SpaRequest, DistinguishesDamageFromSyntaxErrors) {
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

TEST(SpaReply, ChecksumsMatchTheReference) {
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

TEST(SpaReply, EachContinuedExampleMatchesOneChecksumReading) {
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

TEST(SpaReply, ALineFeedChangesTheChecksumByItsCode) {
  EXPECT_EQ(MatchingReadings(Sealed("<1A:", "7C"), true), kCoversAny);
  EXPECT_EQ(Text(EncodeAck(1, kCoversAll | kLineFeedCovered)), "\n<1A:7C\r\n");
  EXPECT_EQ(Text(EncodeAck(1, kCoversAll)), "\n<1A:76\r\n");
}

TEST(SpaReply, TheNackCodeIsTheFirstDigitInAnyLayout) {
  for (const char* text : {"<1N:5:XX\r", "<1N5:XX\r", "<1N: 5:XX\r", "<1N:E5 blocked:XX\r"}) {
    const auto reply = ParseReply(ToBytes(text));
    ASSERT_TRUE(reply) << text;
    EXPECT_EQ(reply->type, 'N');
    EXPECT_EQ(reply->nack, 5) << text;
  }
  EXPECT_EQ(ParseReply(ToBytes("<1N::XX\r"))->nack, std::nullopt);
}

TEST(SpaReply, AnNInTheDataIsNoNack) {
  const auto reply = ParseReply(ToBytes("<1D:NONE 5:XX\r"));
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->type, 'D');
  EXPECT_FALSE(reply->nack);
}

TEST(SpaReply, WrongSyntaxIsRefused) {
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

TEST(SpaReply, DataOfEveryLengthAroundTheLineEndIsDecoded) {
  for (std::size_t length = 245; length <= 260; ++length) {
    const auto frame = EncodeData(1, std::string(length, '1'), kCoversAll);
    const auto frames = Cut(ReplyRule, Accepting(kCoversAll), *frame);
    ASSERT_EQ(frames.size(), 1U) << length;
    EXPECT_EQ(ParseReply(frames[0])->data.size(), length);
  }
}

TEST(SpaReplyRule, AnEchoIsDroppedWithoutReportingDamage) {
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

TEST(SpaReplyRule, ReportsTheKindOfDamage) {
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

TEST(SpaReplyRule, WildcardsAndMissingLineFeedsAreAccepted) {
  const auto frames =
      Cut(ReplyRule, Accepting(kCoversAny | kWildcardAccepted), ToBytes("<1D: SPAJ 142C:XX\r"));
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_TRUE(ParseReply(frames[0])->wildcard);
}

TEST(SpaReplyRule, LimitsLengthAndNumberOfLines) {
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

TEST(SpaReplyRule, AFixedChecksumReadingRefusesTheOthers) {
  const Bytes frame = Sealed("<3D:1.00/2.00/3.0&\r\n0/4.00/5.00:", "72");
  EXPECT_EQ(Cut(ReplyRule, Accepting(kCoversNoLineEnds), frame).size(), 1U);
  EXPECT_EQ(Cut(ReplyRule, Accepting(kCoversAll), frame).size(), 0U);
}

TEST(SpaAddress, ParsesAndPrintsTheForms) {
  for (const char* text : {"I1", "14V1", "F", "C", "V205", "3A", "T", "D", "M0", "O999999"}) {
    const auto address = ParseAddress(text);
    ASSERT_TRUE(address) << text;
    EXPECT_EQ(FormatAddress(*address), text);
  }
  EXPECT_EQ(*ParseAddress("0I1"), *ParseAddress("I01"));
}

TEST(SpaAddress, RefusesWithAnExample) {
  for (const char* text : {"", "1", "I", "i1", "Z1", "F1", "I1/5", "I1 ", "1000I1", "V1234567"}) {
    const auto address = ParseAddress(text);
    ASSERT_FALSE(address) << text;
    EXPECT_NE(address.error().find("such as I1"), std::string::npos) << address.error();
  }
}

Decoded DecodedAs(const std::string& text, Type type, double scale = 1) {
  config::Point point = MakePoint("V1", type);
  point.scale = scale;
  return DecodeValue(text, point);
}

TEST(SpaValue, DecodesByTypeOfThePoint) {
  EXPECT_EQ(DecodedAs("0.52", Type::float32).value, Value(0.52));
  EXPECT_EQ(DecodedAs(" -0.5", Type::float32).value, Value(-0.5));
  EXPECT_EQ(DecodedAs("+85", Type::uint16).value, Value(std::int64_t{85}));
  EXPECT_EQ(DecodedAs("085.00", Type::uint16).value, Value(std::int64_t{85}));
  EXPECT_EQ(DecodedAs("18446744073709551615", Type::uint64).value,
            Value(std::numeric_limits<std::uint64_t>::max()));
  EXPECT_EQ(DecodedAs("1", Type::boolean).value, Value(true));
  EXPECT_EQ(DecodedAs("0", Type::boolean).value, Value(false));
  EXPECT_EQ(DecodedAs(" SPAJ 142C ", Type::string).value, Value(std::string("SPAJ 142C")));
  EXPECT_EQ(DecodedAs("0.52", Type::int16, 100).value, Value(0.52)) << "the scale makes it whole";
}

TEST(SpaValue, NeverDecodesInvalidTextAsANumber) {
  for (const auto& [text, type] :
       std::vector<std::pair<std::string, Type>>{{"2", Type::boolean},
                                                 {"0.5", Type::boolean},
                                                 {"true", Type::boolean},
                                                 {"0.52", Type::int16},
                                                 {"1e3", Type::float32},
                                                 {"nan", Type::float32},
                                                 {"inf", Type::float32},
                                                 {"1,5", Type::float32},
                                                 {"0x10", Type::uint16},
                                                 {"--", Type::float32},
                                                 {"1-2", Type::float32},
                                                 {"1 2", Type::float32}}) {
    const Decoded decoded = DecodedAs(text, type);
    EXPECT_FALSE(HasValue(decoded.value)) << text;
    EXPECT_EQ(decoded.quality, Quality::bad_configuration) << text;
  }
  EXPECT_EQ(DecodedAs("", Type::float32).quality, Quality::bad_sensor_failure);
  EXPECT_FALSE(HasValue(DecodedAs("  ", Type::float32).value));
}

std::string Encoded(const Value& value, Type type, double scale = 1) {
  config::Point point = MakePoint("V1", type);
  point.scale = scale;
  const auto text = EncodeValue(value, point);
  return text ? *text : "error";
}

TEST(SpaValue, EncodesWithoutNeedlessDigits) {
  EXPECT_EQ(Encoded(0.5, Type::float32), "0.5");
  EXPECT_EQ(Encoded(static_cast<double>(0.1F), Type::float32), "0.1");
  EXPECT_EQ(Encoded(4.0, Type::float32), "4");
  EXPECT_EQ(Encoded(-0.0, Type::float32), "0");
  EXPECT_EQ(Encoded(std::int64_t{85}, Type::uint16), "85");
  EXPECT_EQ(Encoded(std::uint64_t{85}, Type::uint16), "85");
  EXPECT_EQ(Encoded(1e6, Type::float64), "1000000");
  EXPECT_EQ(Encoded(true, Type::boolean), "1");
  EXPECT_EQ(Encoded(std::int64_t{0}, Type::boolean), "0");
  EXPECT_EQ(Encoded(0.52, Type::int16, 100), "0.52");
  EXPECT_EQ(Encoded(std::string("SUB 7"), Type::string), "SUB 7");
}

std::string HundredthsText(int hundredths) {
  std::string text = std::to_string(hundredths / 100);
  const int rest = hundredths % 100;
  if (rest == 0) return text;
  text += "." + std::to_string(rest / 10);
  if (rest % 10 != 0) text += std::to_string(rest % 10);
  return text;
}

/// A register that is written as 30.3 contains 30.299999237.
TEST(SpaValue, EncodesTheIntendedDecimals) {
  config::Point settled = MakePoint("S23");
  settled.writing.decimals = 2;
  for (int hundredths = 5; hundredths <= 30000; ++hundredths) {
    const std::string meant = HundredthsText(hundredths);
    const float single = std::strtof(meant.c_str(), nullptr);
    const double full = std::strtod(meant.c_str(), nullptr);
    ASSERT_EQ(Encoded(static_cast<double>(single), Type::float32), meant);
    ASSERT_EQ(Encoded(full, Type::float32), meant);
    ASSERT_EQ(Encoded(full, Type::float64), meant);
    ASSERT_EQ(*EncodeValue(static_cast<double>(single), settled), meant);
    ASSERT_EQ(*EncodeValue(full, settled), meant);
  }
  EXPECT_EQ(Encoded(static_cast<double>(30.3F) / 0.1, Type::float32, 0.1), "303");
  EXPECT_EQ(Encoded(static_cast<double>(208.1F) / 400, Type::float32, 400), "0.52025");
}

TEST(SpaValue, TheTextOfAFloatReadsBackAsTheSameFloat) {
  std::mt19937 random(13);
  for (int i = 0; i < 20000; ++i) {
    const float number = std::ldexp(static_cast<float>(random() >> 8U), -18);
    const std::string text = Encoded(static_cast<double>(number), Type::float32);
    ASSERT_EQ(text.find_first_not_of("0123456789."), std::string::npos) << text;
    if (number < 1) continue;  // a smaller number can need more than nine decimals
    ASSERT_EQ(std::strtof(text.c_str(), nullptr), number) << text;
  }
}

std::string EncodedWith(int decimals, double number, double scale = 1) {
  config::Point point = MakePoint("S1");
  point.writing.decimals = decimals;
  point.scale = scale;
  const auto text = EncodeValue(number, point);
  return text ? *text : "error: " + text.error();
}

TEST(SpaValue, RoundsToTheDecimalsOfThePoint) {
  EXPECT_EQ(EncodedWith(2, 30.299999237060547), "30.3");
  EXPECT_EQ(EncodedWith(2, 0.524), "0.52");
  EXPECT_EQ(EncodedWith(2, 2.675), "2.68") << "though a double of 2.675 is less";
  EXPECT_EQ(EncodedWith(2, -2.675), "-2.68");
  EXPECT_EQ(EncodedWith(2, 9.995), "10");
  EXPECT_EQ(EncodedWith(2, -99.996), "-100");
  EXPECT_EQ(EncodedWith(0, 0.5), "1");
  EXPECT_EQ(EncodedWith(0, 12.4), "12");
  EXPECT_EQ(EncodedWith(3, 4), "4") << "no needless zeros";
  EXPECT_EQ(EncodedWith(9, 0.123456789), "0.12345679") << "more a float32 does not hold";
  EXPECT_EQ(EncodedWith(2, 208.1 / 400, 400), "0.52") << "they are counted on the wire";
  EXPECT_EQ(EncodedWith(2, 0.004),
            "error: 0.004, rounded to the 2 decimals of 'p_S1', is 0: the number is too small to "
            "be written");
}

TEST(SpaValue, RoundingStaysWithinTheLimits) {
  config::Point point = MakePoint("S1");
  point.writing.decimals = 1;
  point.writing.min = 0.25;
  point.writing.max = 2.55;
  EXPECT_EQ(*EncodeValue(0.25, point), "0.3");
  EXPECT_EQ(*EncodeValue(2.54, point), "2.5");
  EXPECT_FALSE(EncodeValue(2.55, point)) << "it would be 2.6";
  point.writing.decimals = 2;
  EXPECT_EQ(*EncodeValue(static_cast<double>(2.55F), point), "2.55");
  point.scale = 400;
  point.writing.max = 1020;
  EXPECT_EQ(*EncodeValue(2.55, point), "2.55") << "limits are in units of the value";
}

TEST(SpaValue, NeverEncodesAnExponent) {
  EXPECT_EQ(Encoded(1e12, Type::float64), "1000000000000");
  EXPECT_EQ(Encoded(123456789012.5, Type::float64), "123456789012.5");
  EXPECT_EQ(Encoded(16777216.0, Type::float32), "16777216");
  EXPECT_EQ(Encoded(0.000001, Type::float32), "0.000001");
  EXPECT_EQ(Encoded(std::int64_t{9007199254740991}, Type::int64), "9007199254740991");
  EXPECT_EQ(Encoded(0.1 + 0.2, Type::float64), "0.3");
}

TEST(SpaValue, RefusesValuesThatDoNotFit) {
  EXPECT_EQ(Encoded(std::int64_t{70000}, Type::uint16), "error");
  EXPECT_EQ(Encoded(std::int64_t{-1}, Type::uint16), "error");
  EXPECT_EQ(Encoded(0.5, Type::uint16), "error");
  EXPECT_EQ(Encoded(std::int64_t{2}, Type::boolean), "error");
  EXPECT_EQ(Encoded(std::nan(""), Type::float32), "error");
  EXPECT_EQ(Encoded(Value(), Type::float32), "error");
  EXPECT_EQ(Encoded(1e-10, Type::float32), "error") << "it would become 0";
  EXPECT_EQ(Encoded(1e300, Type::float64), "error");
  EXPECT_EQ(Encoded(std::string("1"), Type::uint16), "error");
  EXPECT_EQ(Encoded(1.0, Type::string), "error");
}

TEST(SpaValue, ATextCannotInjectASecondFrame) {
  for (const char* text : {"a:b", "a/b", "a<b", "a>b", "a&b", "a\rb", "a\nb", "\x80", ""}) {
    EXPECT_EQ(Encoded(std::string(text), Type::string), "error") << text;
  }
  EXPECT_EQ(Encoded(std::string(132, 'x'), Type::string), "error");
}

TEST(SpaValue, PrintsLikeARelay) {
  EXPECT_EQ(PrintValue(0.5, MakePoint("I1")), "0.50");
  EXPECT_EQ(PrintValue(0.4567891, MakePoint("I1")), "0.4568");
  config::Point settled = MakePoint("S1");
  settled.writing.decimals = 3;
  EXPECT_EQ(PrintValue(0.4567891, settled), "0.457");
  settled.writing.decimals = 1;
  EXPECT_EQ(PrintValue(0.5, settled), "0.5");
  EXPECT_EQ(PrintValue(85.0, MakePoint("V1", Type::uint16)), "85");
  EXPECT_EQ(PrintValue(1.0, MakePoint("O1", Type::boolean)), "1");
  EXPECT_EQ(PrintValue(std::string("a:b"), MakePoint("F", Type::string)), "a-b");
}

std::vector<config::Point> ThreeChannels() {
  return {MakePoint("1I1"), MakePoint("2I1"), MakePoint("3I1")};
}

TEST(SpaChannels, AreReadAsARange) {
  Talk talk(SpabusProtocol(), MakeDevice(ThreeChannels()));
  EXPECT_EQ(AllRequests(talk), (Texts{">1R1/3I1:"}));
  Asked(talk, Poll(0));
  const Answer answer = Hear(talk, Poll(0), "<1D:1/2/3:");
  ASSERT_EQ(answer.readings.size(), 3U);
  EXPECT_EQ(answer.readings[2].point, 2U);
  EXPECT_EQ(ToDouble(answer.readings[2].value), 3);
  EXPECT_EQ(talk->WhatIsLearned(), "it accepts several channels in one request");
}

TEST(SpaChannels, AreReadOneByOneIfARangeIsRefused) {
  for (const char* refusal : {"<1N:3:", "<1N:5:"}) {
    Talk talk(SpabusProtocol(), MakeDevice(ThreeChannels()));
    Asked(talk, Poll(0));
    EXPECT_EQ(Hear(talk, Poll(0), refusal).then, Then::replan);
    EXPECT_EQ(AllRequests(talk), (Texts{">1R1I1:", ">1R2I1:", ">1R3I1:"})) << refusal;
    EXPECT_EQ(talk->WhatIsLearned(), "it accepts only one channel in one request");
  }
  for (const Outcome outcome : {Outcome::no_reply, Outcome::unexpected}) {
    Talk talk(SpabusProtocol(), MakeDevice(ThreeChannels()));
    Asked(talk, Poll(0));
    EXPECT_EQ(talk.Fail(Poll(0), outcome), Then::done) << "one reply may be lost";
    Asked(talk, Poll(0));
    EXPECT_EQ(talk.Fail(Poll(0), outcome), Then::replan);
    EXPECT_EQ(AllRequests(talk).size(), 3U);
  }
}

TEST(SpaChannels, KeepTheirRangeAfterALostReply) {
  Talk talk(SpabusProtocol(), MakeDevice(ThreeChannels()));
  Asked(talk, Poll(0));
  Hear(talk, Poll(0), "<1D:1/2/3:");
  for (int i = 0; i < 5; ++i) {
    Asked(talk, Poll(0));
    EXPECT_EQ(talk.Fail(Poll(0), Outcome::no_reply), Then::done);
  }
  EXPECT_EQ(AllRequests(talk), (Texts{">1R1/3I1:"}));
}

TEST(SpaChannels, SilenceToSeveralItemsReducesTheirNumber) {
  Talk talk(SpabusProtocol(), MakeDevice({MakePoint("I1"), MakePoint("I2"), MakePoint("V1")}));
  ASSERT_EQ(AllRequests(talk), (Texts{">1RI1/2:", ">1RV1:"}));
  const auto fail = [&] {
    Asked(talk, Poll(0));
    return talk.Fail(Poll(0), Outcome::no_reply);
  };
  for (int i = 0; i < 5; ++i) EXPECT_EQ(fail(), Then::done) << "it may be away";
  Asked(talk, Poll(1));
  Hear(talk, Poll(1), "<1D:7:");
  EXPECT_EQ(fail(), Then::done);
  EXPECT_EQ(fail(), Then::done);
  EXPECT_EQ(fail(), Then::replan);
  EXPECT_EQ(AllRequests(talk), (Texts{">1RI1:", ">1RI2:", ">1RV1:"}));
}

}  // namespace
}  // namespace baudgate::protocols::spabus
