// Tests that the frame rules for readers keep the laws in protocols/frame_rule.h.
// SPDX-License-Identifier: Apache-2.0
#include "config/catalog/option_values.h"
#include "protocols/reader/codec.h"
#include "protocols/reader/protocol.h"
#include "protocols/reader/rules.h"
#include "tests/laws/frame_rule_laws.h"

namespace baudgate::protocols {
namespace {

namespace reader = protocols::reader;
using ::testing::ValuesIn;

config::Options TextOptions(const std::string& start, const std::string& end, int length) {
  config::Options options = config::DefaultOptions(ReaderProtocol());
  options.Set("form", std::string("text"));
  options.Set("start", start);
  options.Set("end", end);
  options.Set("length", std::int64_t{length});
  return options;
}

LawSubject Subject(const std::string& name, const config::Options& options,
                   const std::vector<std::string>& frames, std::string_view noise) {
  LawSubject subject;
  subject.name = name;
  subject.rule = reader::MessageRule;
  subject.expect = reader::Expect({}, reader::ReadSettings(options));
  for (const std::string& frame : frames) subject.frames.push_back(ToBytes(frame));
  subject.garbage = [noise](std::mt19937& random) {
    Bytes bytes(random() % 40);
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(noise[random() % noise.size()]);
    return bytes;
  };
  subject.checksum = false;
  return subject;
}

std::vector<LawSubject> Subjects() {
  LawSubject tags =
      Subject("Tags", config::DefaultOptions(ReaderProtocol()),
              {"\r\n-06001259E3\r\n>", "\r\n-0000000000\r\n>", "\r\n-ffFF00aa11\r\n>"},
              "\r\n->0123456789AFx\x80");
  config::Options asked = config::DefaultOptions(ReaderProtocol());
  asked.Set("commands", std::string("ask"));
  LawSubject among_answers =
      Subject("TagsAmongAnswers", asked, {"\r\n-06001259E3\r\n>", "\r\n-0000000000\r\n>"},
              "\r\n->0123456789AFxMOD\x80");
  LawSubject information = Subject(
      "Information", asked, {"\r\nMOD-RFID125-BOX\r\n>", "i\r\nMOD\r\nVer 1.3\r\n>"}, "abc 123");
  information.expect = reader::Expect(reader::EncodeCommand(reader::Command::information),
                                      reader::ReadSettings(asked));
  information.found_behind_garbage = false;
  LawSubject marked = Subject("StartAndEnd", TextOptions("0x02", "0x03", 0),
                              {"\x02"
                               "ST,GS,+  12.35kg\x03",
                               "\x02\x03",
                               "\x02"
                               "4006381333931\x03"},
                              "abc 123,\x02\r\n\x80");
  LawSubject counted =
      Subject("StartAndLength", TextOptions(":", "", 5), {":12345", ":a:b:c"}, "abc 123,\r\n\x80");
  LawSubject line =
      Subject("Line", TextOptions("", "0x0D", 0), {"4006381333931\r", "ST,GS 12\r"}, "abc 123,");
  line.found_behind_garbage = false;
  LawSubject silence = Subject("Silence", TextOptions("", "", 0), {"4006381333931", "a"}, "abc");
  silence.found_behind_garbage = false;
  return {tags, among_answers, information, marked, counted, line, silence};
}

INSTANTIATE_TEST_SUITE_P(Reader, FrameRuleLaws, ValuesIn(Subjects()), LawSubjectName);
INSTANTIATE_TEST_SUITE_P(Reader, GarbageLaws, ValuesIn(FoundBehindGarbage(Subjects())),
                         LawSubjectName);
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(ChecksumLaws);

std::vector<std::string> CutBy(const config::Options& options, std::string_view stream,
                               Outcome* blame = nullptr) {
  Assembler assembler;
  assembler.Begin(reader::MessageRule, reader::Expect({}, reader::ReadSettings(options)));
  assembler.Feed(ToBytes(stream));
  std::vector<std::string> frames;
  while (auto frame = assembler.Next(false)) frames.emplace_back(AsText(*frame));
  while (auto frame = assembler.Next(true)) frames.emplace_back(AsText(*frame));
  if (blame != nullptr) *blame = assembler.blame();
  return frames;
}

using Frames = std::vector<std::string>;

TEST(ReaderFrames, ThePromptMayBeMissingOrComeFirst) {
  const config::Options tags = config::DefaultOptions(ReaderProtocol());
  EXPECT_EQ(CutBy(tags, ">\r\n-06001259E3\r\n>\r\n-06001259E4\r\n>"),
            (Frames{"\r\n-06001259E3\r\n>", "\r\n-06001259E4\r\n>"}));
  EXPECT_EQ(CutBy(tags, "\r\n-06001259E3\r\n\r\n-06001259E4\r\n"),
            (Frames{"\r\n-06001259E3\r\n", "\r\n-06001259E4\r\n"}));
}

TEST(ReaderFrames, ATagWithAMissingOrExtraCharacterIsDropped) {
  const config::Options tags = config::DefaultOptions(ReaderProtocol());
  const std::string good = "\r\n-06001259E3\r\n>";
  for (std::size_t at = 0; at + 1 < good.size(); ++at) {
    std::string cut = good;
    cut.erase(at, 1);
    EXPECT_EQ(CutBy(tags, cut), Frames{}) << at;
    std::string more = good;
    more.insert(at, "7");
    EXPECT_EQ(CutBy(tags, more).size(), at == 0 ? 1U : 0U) << at;
  }
}

TEST(ReaderFrames, ATooLongTextIsDroppedCompletely) {
  config::Options line = TextOptions("", "0x0D", 0);
  line.Set("most", std::int64_t{10});
  EXPECT_EQ(CutBy(line, "12345678901\r123\r"), Frames{"123\r"});
  EXPECT_EQ(CutBy(line, std::string(500, '1') + "\r123\r"), Frames{"123\r"});
  config::Options silence = TextOptions("", "", 0);
  silence.Set("most", std::int64_t{10});
  EXPECT_EQ(CutBy(silence, std::string(500, '1')), Frames{});
  EXPECT_EQ(CutBy(TextOptions("", "0x0D", 3), "1234\r12\r123\r"), Frames{"123\r"});
}

/// Some messages in the stream are too long. They must be dropped as a whole, in whatever pieces
/// they arrive.
TEST(ReaderFrames, AStreamGivesTheSameFramesAtEveryCut) {
  config::Options tags = config::DefaultOptions(ReaderProtocol());
  std::vector<config::Options> forms = {tags};
  for (const auto& [start, end, length] :
       std::vector<std::tuple<std::string, std::string, int>>{{"", "0x0D", 0},
                                                              {"", "0x0A", 0},
                                                              {"", "0x0D", 5},
                                                              {"", "", 0},
                                                              {"", "", 5},
                                                              {":", "0x0D", 0},
                                                              {":", "", 5},
                                                              {":", "", 0},
                                                              {":", ":", 0}}) {
    forms.push_back(TextOptions(start, end, length));
    forms.back().Set("most", std::int64_t{10});
  }
  const std::vector<std::string> words = {"\r\n-",
                                          "06001259E3",
                                          "\r\n>",
                                          "\r",
                                          "\n",
                                          std::string(1, '\0'),
                                          "\xFF",
                                          ":",
                                          "12345",
                                          "kg",
                                          std::string(20, '\n'),
                                          std::string(40, '7')};
  std::mt19937 random(20261123);
  for (int round = 0; round < 20'000; ++round) {
    const config::Options& options = forms[random() % forms.size()];
    std::string stream;
    for (auto count = random() % 12; count > 0; --count) stream += words[random() % words.size()];
    Outcome blame = Outcome::none;
    const Frames whole = CutBy(options, stream, &blame);
    Assembler assembler;
    assembler.Begin(reader::MessageRule, reader::Expect({}, reader::ReadSettings(options)));
    Frames cut;
    const auto take = [&](bool idle) {
      while (auto frame = assembler.Next(idle)) cut.emplace_back(AsText(*frame));
    };
    for (std::size_t at = 0; at < stream.size();) {
      const std::size_t size = std::min<std::size_t>(1 + random() % 9, stream.size() - at);
      assembler.Feed(ToBytes(stream.substr(at, size)));
      take(false);
      at += size;
    }
    take(true);
    ASSERT_EQ(cut, whole) << Printable(ToBytes(stream));
    ASSERT_EQ(assembler.blame(), blame) << Printable(ToBytes(stream));
  }
}

TEST(ReaderFrames, InformationEndsAtItsPromptOrSilenceAfterALine) {
  const auto cut = [](const std::string& text, bool idle) {
    return reader::MessageRule(
        ToBytes(text),
        reader::Expect(reader::EncodeCommand(reader::Command::information),
                       reader::ReadSettings(config::DefaultOptions(ReaderProtocol()))),
        idle);
  };
  const std::string whole = "\r\nMOD-RFID125-BOX\r\n>";
  EXPECT_EQ(cut(whole + "\r\n-", false).size, whole.size());
  for (std::size_t size = 1; size < whole.size(); ++size) {
    EXPECT_EQ(cut(whole.substr(0, size), false).kind, protocols::Cut::Kind::need_more) << size;
    const auto silent = cut(whole.substr(0, size), true);
    const bool line = size > 17;
    EXPECT_EQ(silent.kind, line ? protocols::Cut::Kind::frame : protocols::Cut::Kind::discard)
        << size;
    EXPECT_EQ(silent.blame, size > 2 && !line ? Outcome::partial : Outcome::none) << size;
  }
  EXPECT_EQ(cut("i\r\n", true).blame, Outcome::none) << "its echo; the answer comes yet";
  EXPECT_EQ(cut("\r\n-06001x59E3\r\n>", false).blame, Outcome::corrupt);
  EXPECT_EQ(cut(std::string(300, 'a'), false).blame, Outcome::corrupt);
}

TEST(ReaderFrames, ABrokenTextIsFollowedByTheNextText) {
  EXPECT_EQ(CutBy(TextOptions("0x02", "0x03", 0),
                  "\x02"
                  "12\x02"
                  "3456\x03"),
            Frames{"\x02"
                   "3456\x03"});
}

TEST(ReaderFrames, LineFeedsBetweenLinesAreIgnored) {
  EXPECT_EQ(CutBy(TextOptions("", "0x0D", 0), "12\r\n34\r\n\r\n"), (Frames{"12\r", "\n34\r"}));
  EXPECT_EQ(CutBy(TextOptions("", "0x0D", 2), "12\r\n34\r\n"), (Frames{"12\r", "\n34\r"}));
}

TEST(ReaderRequests, AreLimitedToTheLongestFrame) {
  const Expectation expect{.max_bytes = 4};
  EXPECT_EQ(reader::RequestRule(ToBytes("abc\r"), expect, false).kind, Cut::Kind::frame);
  EXPECT_EQ(reader::RequestRule(ToBytes("abc"), expect, false).kind, Cut::Kind::need_more);
  for (const char* held : {"abcd", "abcd\r"}) {
    EXPECT_EQ(reader::RequestRule(ToBytes(held), expect, false).blame, Outcome::corrupt) << held;
  }
}

}  // namespace
}  // namespace baudgate::protocols
