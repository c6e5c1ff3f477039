// Tests that the frame rules for SET-4TM keep the laws in protocols/frame_rule.h: for requests, and
// for replies of every shape and address form.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/bytes.h"
#include "protocols/set4tm/meter/codec.h"
#include "protocols/set4tm/rules.h"
#include "tests/laws/frame_rule_laws.h"
#include "tests/protocols/set4tm/support.h"

namespace baudgate::protocols {
namespace {

using protocols::set4tm::Hex;

Bytes Noise(std::mt19937& random) {
  Bytes bytes(random() % 40);
  for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
  return bytes;
}

/// Returns replies of another length or meter, truncated replies, or a break on the line.
Bytes ForeignReplies(std::mt19937& random) {
  const Bytes kTimeReply = Hex("05 31 30 15 01 02 09 02 00 28 A4");
  switch (random() % 4) {
    case 0:
      return Bytes(kTimeReply.begin(), kTimeReply.begin() + 1 + random() % 9);
    case 1:
      return Bytes(random() % 5, 0xFF);
    case 2:
      return Bytes(random() % 5, 0x00);
    default:
      return Noise(random);
  }
}

LawSubject Replies(std::string name, std::string_view request, std::vector<Bytes> frames) {
  LawSubject subject;
  subject.name = std::move(name);
  subject.rule = protocols::set4tm::ReplyRule;
  subject.expect = protocols::set4tm::Expect(Hex(request), protocols::set4tm::DefaultSettings());
  subject.frames = std::move(frames);
  subject.garbage = ForeignReplies;
  return subject;
}

std::vector<LawSubject> Subjects() {
  std::vector<LawSubject> subjects;
  LawSubject requests;
  requests.name = "Requests";
  requests.rule = protocols::set4tm::RequestRule;
  requests.expect = protocols::set4tm::Expect({}, protocols::set4tm::DefaultSettings());
  requests.frames = {Hex("01 00 00 20"),
                     Hex("C8 01 30 30 30 30 30 30 03 D2"),
                     Hex("C8 08 1B 00 11 77 BB"),
                     Hex("05 0A 00 00 02 0F 00 EA 9A"),
                     Hex("05 08 04 67 C2"),
                     Hex("FC 00 89 A2 61 08 00 8F 76"),
                     Hex("05 08 23 A5 00 00 00 10 00 0E 0E FF FF 3C 2C")};
  requests.garbage = Noise;
  subjects.push_back(requests);
  subjects.push_back(
      Replies("OneFloat", "C8 08 1B 00 11 77 BB",
              {Hex("C8 00 80 66 43 AE 69"), protocols::set4tm::MakeFrame(Bytes{0xC8}, Bytes{0x05}),
               protocols::set4tm::MakeFrame(protocols::set4tm::ExtendedAddress(9020001),
                                            Hex("00 80 66 43"))}));
  subjects.push_back(Replies(
      "Energy", "05 05 00 02 91 28",
      {Hex("05 00 00 27 11 00 00 00 00 00 00 13 89 00 00 00 65 67 40"), Hex("05 05 C2 E3")}));
  subjects.push_back(
      Replies("Status", "05 01 30 30 30 30 30 30 CE 1B", {Hex("05 00 02 E0"), Hex("05 04 03 23")}));
  subjects.push_back(Replies(
      "Extended", "FC 00 89 A2 61 08 00 8F 76",
      {Hex("FC 00 89 A2 61 00 89 A2 61 06 09 02 58 BB"),
       protocols::set4tm::MakeFrame(protocols::set4tm::ExtendedAddress(9020001), Bytes{0x05})}));
  Bytes snapshot(93);
  for (std::size_t i = 0; i < snapshot.size(); ++i) snapshot[i] = static_cast<std::uint8_t>(i * 7);
  subjects.push_back(Replies("Snapshot", "05 08 23 A5 00 00 00 10 00 0E 0E FF FF 3C 2C",
                             {protocols::set4tm::MakeFrame(Bytes{5}, snapshot)}));
  // KS is weak: one of 256 runs of noise ends in a valid KS.
  config::Options ks = protocols::set4tm::DefaultOptions();
  ks.Set("checksum", std::string("ks"));
  LawSubject old;
  old.name = "Ks";
  old.rule = protocols::set4tm::ReplyRule;
  old.expect = protocols::set4tm::Expect(Hex("05 08 00 F2"), protocols::set4tm::ReadSettings(ks));
  old.frames = {Hex("05 00 89 A2 61 06 09 02 BD"), Hex("05 05 FF")};
  old.garbage = ForeignReplies;
  old.found_behind_garbage = false;
  subjects.push_back(old);
  return subjects;
}

using ::testing::ValuesIn;
INSTANTIATE_TEST_SUITE_P(Set4tm, FrameRuleLaws, ValuesIn(Subjects()), LawSubjectName);
INSTANTIATE_TEST_SUITE_P(Set4tm, ChecksumLaws, ValuesIn(WithChecksum(Subjects())), LawSubjectName);
INSTANTIATE_TEST_SUITE_P(Set4tm, GarbageLaws, ValuesIn(FoundBehindGarbage(Subjects())),
                         LawSubjectName);

Expectation AwaitFloat() {
  return protocols::set4tm::Expect(Hex("C8 08 1B 00 11 77 BB"),
                                   protocols::set4tm::DefaultSettings());
}

TEST(Set4tmReplyRule, StatusInPlaceOfDataWaitsForSilence) {
  const Bytes status = protocols::set4tm::MakeFrame(Bytes{0xC8}, Bytes{0x05});
  EXPECT_EQ(protocols::set4tm::ReplyRule(status, AwaitFloat(), false).kind, Cut::Kind::need_more);
  const Cut cut = protocols::set4tm::ReplyRule(status, AwaitFloat(), true);
  EXPECT_EQ(cut.kind, Cut::Kind::frame);
  EXPECT_EQ(cut.size, 4U);
}

TEST(Set4tmReplyRule, StatusToAWriteIsCompleteAtOnce) {
  const Expectation expect = protocols::set4tm::Expect(Hex("05 01 30 30 30 30 30 30 CE 1B"),
                                                       protocols::set4tm::DefaultSettings());
  EXPECT_EQ(protocols::set4tm::ReplyRule(Hex("05 00 02 E0"), expect, false).size, 4U);
}

TEST(Set4tmReplyRule, StatusFollowedByABreakIsNoValue) {
  Bytes lengthened = protocols::set4tm::MakeFrame(Bytes{0xC8}, Bytes{0x05});
  lengthened.resize(7);
  ASSERT_TRUE(EndsInCrc16(lengthened));
  const Cut cut = protocols::set4tm::ReplyRule(lengthened, AwaitFloat(), true);
  EXPECT_EQ(cut.kind, Cut::Kind::discard);
  EXPECT_EQ(cut.blame, Outcome::corrupt);
}

TEST(Set4tmReplyRule, AReplyOfAnotherLengthIsAFrameBeforeSilence) {
  for (const char* body : {"12 34", "00 89 A2 61 06 09 02", "00 00 27 11 00 00 00 00"}) {
    const Bytes reply = protocols::set4tm::MakeFrame(Bytes{0xC8}, Hex(body));
    Assembler assembler;
    assembler.Begin(protocols::set4tm::ReplyRule, AwaitFloat());
    assembler.Feed(reply);
    EXPECT_FALSE(assembler.Next(false)) << body;
    EXPECT_EQ(assembler.Next(true), std::optional(reply)) << body;
  }
}

TEST(Set4tmReplyRule, DamageIsCorruptAndAnIncompleteReplyIsPartial) {
  Assembler assembler;
  assembler.Begin(protocols::set4tm::ReplyRule, AwaitFloat());
  assembler.Feed(Hex("C8 00 80 66 43 AE 68"));
  EXPECT_FALSE(assembler.Next(true));
  EXPECT_EQ(assembler.blame(), Outcome::corrupt);
  assembler.Begin(protocols::set4tm::ReplyRule, AwaitFloat());
  assembler.Feed(Hex("C8 00 80 66"));
  EXPECT_FALSE(assembler.Next(true));
  EXPECT_EQ(assembler.blame(), Outcome::partial);
}

TEST(Set4tmRequestRule, UnlistedCodesEndWithSilence) {
  const Bytes request = protocols::set4tm::MakeFrame(Bytes{5}, Hex("08 7F 01"));
  const Expectation expect = protocols::set4tm::Expect({}, protocols::set4tm::DefaultSettings());
  EXPECT_EQ(protocols::set4tm::RequestRule(request, expect, false).kind, Cut::Kind::need_more);
  EXPECT_EQ(protocols::set4tm::RequestRule(request, expect, true).size, request.size());
}

}  // namespace
}  // namespace baudgate::protocols
