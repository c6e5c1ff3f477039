// Tests what the conversation of a reader makes of tags: repeats, numbers, the ring of the latest
// tags.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/reader/conversation.h"

#include <gtest/gtest.h>

#include <string>

#include "gateway/base/text.h"
#include "protocols/reader/codec.h"
#include "protocols/reader/rules.h"
#include "tests/protocols/reader/support.h"

namespace baudgate::protocols {
namespace {

using protocols::reader::ReaderConversation;

constexpr WallTime kEpoch{1'790'000'000s};

class ReaderConversationTest : public ::testing::Test {
 protected:
  void Make(config::Device device) {
    device_ = std::move(device);
    reader_ = std::make_unique<ReaderConversation>(
        device_, protocols::reader::ReadSettings(device_.options));
  }
  Answer Hear(const std::string& digits, Duration at) {
    return reader_->OnUnasked(TagFrame(digits), {Instant(at), kEpoch + at});
  }
  Answer HearText(const std::string& text, Duration at) {
    return reader_->OnUnasked(ToBytes(text), {Instant(at), kEpoch + at});
  }
  bool IsNew(const std::string& digits, Duration at) { return Hear(digits, at).batch.has_value(); }
  static std::string Shown(const Answer& answer, std::size_t point) {
    std::string shown = "nothing";
    for (const Reading& reading : answer.readings) {
      if (reading.point != point) continue;
      shown = IsGood(reading.quality) ? ToText(reading.value) : Name(reading.quality);
    }
    return shown;
  }

  config::Device device_;
  std::unique_ptr<ReaderConversation> reader_;
};

TEST_F(ReaderConversationTest, ATagGivesSixValuesAndAnEvent) {
  Make(Reader());
  const Answer answer = Hear("06001259e3", 1h);
  EXPECT_EQ(Shown(answer, 0), "06001259E3");
  EXPECT_EQ(Shown(answer, 1), "6") << "0x0006";
  EXPECT_EQ(Shown(answer, 2), "18") << "0x0012: of 0x0600'1259'E3 the bits 31 to 16";
  EXPECT_EQ(Shown(answer, 3), "23011") << "0x59E3";
  EXPECT_EQ(Shown(answer, 4), "1");
  EXPECT_EQ(Shown(answer, 5), "true");
  EXPECT_EQ(Shown(answer, 6), "bad: sensor failure, not ready") << "there was no tag before it";
  ASSERT_TRUE(answer.batch);
  ASSERT_EQ(answer.batch->events.size(), 1U);
  EXPECT_EQ(answer.batch->events[0].code, 1U);
  EXPECT_EQ(answer.batch->events[0].text, "06001259E3");
  EXPECT_EQ(answer.batch->said, "1");
  EXPECT_FALSE(answer.batch->again) << "the same tag once more is another event";
}

TEST_F(ReaderConversationTest, ARepeatedTagIsNotNewWithinTheWindow) {
  Make(Reader({{"same_tag", "2s"}}));
  EXPECT_TRUE(IsNew("0000000001", 1h));
  EXPECT_FALSE(IsNew("0000000001", 1h + 1999ms));
  EXPECT_FALSE(IsNew("0000000001", 1h + 3998ms)) << "it never went away";
  EXPECT_TRUE(IsNew("0000000001", 1h + 5998ms));
  EXPECT_TRUE(IsNew("0000000002", 1h + 6s));
  EXPECT_FALSE(IsNew("0000000001", 1h + 6001ms)) << "two that take turns";
  const Answer repeat = Hear("0000000001", 1h + 6002ms);
  EXPECT_EQ(Shown(repeat, 0), "nothing") << "the age of the tag is that of its event";
  EXPECT_EQ(Shown(repeat, 5), "true");
}

TEST_F(ReaderConversationTest, WithoutAWindowEveryMessageIsANewTag) {
  Make(Reader({{"same_tag", "0s"}}));
  EXPECT_TRUE(IsNew("0000000001", 1h));
  EXPECT_TRUE(IsNew("0000000001", 1h));
}

TEST_F(ReaderConversationTest, ANoTagMessageOrATimeoutEndsThePresence) {
  Make(Reader({{"present", "3s"}}));
  EXPECT_EQ(reader_->DueAt(), std::nullopt);
  Hear("0000000001", 1h);
  EXPECT_EQ(reader_->DueAt(), Instant(1h + 3s));
  EXPECT_TRUE(reader_->OnDue({Instant(1h + 2s), kEpoch}).readings.empty());
  EXPECT_EQ(Shown(reader_->OnDue({Instant(1h + 3s), kEpoch}), 5), "false");
  EXPECT_EQ(reader_->DueAt(), std::nullopt);
  Hear("0000000002", 2h);
  const Answer none = Hear("0000000000", 2h + 1s);
  EXPECT_EQ(Shown(none, 5), "false");
  EXPECT_EQ(Shown(none, 0), "nothing") << "no tag is no tag";
  EXPECT_FALSE(none.batch);
  EXPECT_EQ(reader_->DueAt(), std::nullopt);
}

TEST_F(ReaderConversationTest, TheRingKeepsSixteen) {
  config::Device device = Reader();
  for (const char* read : {"tag@15", "counter@15", "low@2", "time"}) {
    const bool text = std::string_view(read).starts_with("tag");
    device.points.push_back(ReaderPoint(read, text ? config::Type::string : config::Type::uint32));
  }
  Make(std::move(device));
  Answer answer;
  for (int tag = 1; tag <= 20; ++tag) {
    answer = Hear((tag < 10 ? "000000000" : "00000000") + std::to_string(tag), 1h + tag * 1s);
    const bool kept = Shown(answer, 7) != "bad: sensor failure, not ready";
    EXPECT_EQ(kept, tag >= 16) << tag;
  }
  EXPECT_EQ(Shown(answer, 0), "0000000020");
  EXPECT_EQ(Shown(answer, 6), "0000000019");
  EXPECT_EQ(Shown(answer, 7), "0000000005");
  EXPECT_EQ(Shown(answer, 8), "5");
  EXPECT_EQ(Shown(answer, 9), "24") << "0x18";
  EXPECT_EQ(Shown(answer, 10), std::to_string(1'790'000'000 + 3600 + 20));
}

TEST_F(ReaderConversationTest, NumbersContinueAfterARestart) {
  Make(Reader());
  reader_->OnEventsKept("41");
  EXPECT_EQ(Shown(Hear("0000000001", 1h), 4), "42");
  reader_->OnEventsKept("42");
  EXPECT_EQ(Shown(Hear("0000000002", 1h), 4), "43");
}

TEST_F(ReaderConversationTest, AnInvalidStoredNumberRestartsTheCount) {
  Make(Reader());
  reader_->OnEventsKept("what is this");
  EXPECT_EQ(Shown(Hear("0000000001", 1h), 4), "1");
}

TEST_F(ReaderConversationTest, WithoutEventsATagGivesOnlyValues) {
  config::Device device = Reader();
  device.events = false;
  Make(std::move(device));
  const Answer answer = Hear("0000000001", 1h);
  EXPECT_FALSE(answer.batch);
  EXPECT_EQ(Shown(answer, 4), "1");
}

TEST_F(ReaderConversationTest, TheListOfRecentTagsIsBounded) {
  Make(Reader({{"same_tag", "1h"}}));
  for (int tag = 1; tag <= 5000; ++tag) {
    std::string digits = std::to_string(tag);
    digits.insert(0, 10 - digits.size(), '0');
    EXPECT_TRUE(IsNew(digits, 1h + tag * 1ms));
  }
  EXPECT_FALSE(IsNew("0000005000", 1h + 6s)) << "the latest are known";
}

TEST_F(ReaderConversationTest, ATextGivesACodeAndANumber) {
  config::Device device = Reader({{"form", "text"}});
  device.points = {ReaderPoint("tag", config::Type::string),
                   ReaderPoint("number", config::Type::float32),
                   ReaderPoint("message", config::Type::string)};
  Make(std::move(device));
  Answer answer = HearText("OL\r", 1h - 1s);
  EXPECT_EQ(Shown(answer, 1), "nothing") << "it was never read";
  answer = HearText("ST,GS,-  12.35kg\r", 1h);
  EXPECT_EQ(Shown(answer, 0), "ST,GS,-  12.35kg");
  EXPECT_EQ(Shown(answer, 1), "-12.35");
  answer = HearText("ST,GS,-  12.35kg\r", 1h + 1s);
  EXPECT_EQ(Shown(answer, 0), "nothing") << "no new code";
  EXPECT_EQ(Shown(answer, 1), "-12.35") << "yet it was weighed anew";
  answer = HearText("OL\r", 1h + 2s);
  EXPECT_EQ(Shown(answer, 1), "bad: sensor failure") << "never a number that looks real";
  EXPECT_EQ(Shown(answer, 2), "OL");
  EXPECT_EQ(HearText("GS 12.3kg NT 10.1kg\r", 1h + 3s).reason,
            "there are 2 numbers in 'GS 12.3kg NT 10.1kg'");
  EXPECT_EQ(HearText("$GPGGA,063905.00,4717.1,N,00833.9,E\r", 1h + 3s).reason,
            "sentences of NMEA 0183 come ('$GPGGA,063905.00,4717.1,N,0083')");
  EXPECT_EQ(HearText("ST,GS,+  12,35kg\r", 1h + 3s).reason,
            "the number in 'ST,GS,+  12,35kg' has a decimal comma");
  EXPECT_EQ(HearText("12.35-kg\r", 1h + 4s).reason,
            "the sign comes after the number in '12.35-kg'");
}

TEST_F(ReaderConversationTest, CharactersBeyondAsciiAreDamage) {
  Make(Reader({{"form", "text"}}));
  const Answer answer = HearText(
      "40\xB3"
      "63\r",
      1h);
  EXPECT_EQ(answer.outcome, Outcome::corrupt);
  EXPECT_TRUE(answer.readings.empty());
  EXPECT_FALSE(answer.batch);
}

TEST_F(ReaderConversationTest, ACapturedRequestOfAnotherMasterIsDecoded) {
  Make(Reader());
  const Answer answer = reader_->Interpret(ToBytes("i\r"), ToBytes("A\r"));
  ASSERT_EQ(answer.readings.size(), 1U);
  EXPECT_EQ(ToText(answer.readings[0].value), "A");
}

TEST_F(ReaderConversationTest, AnUnaskedReaderIsNeverPolled) {
  Make(Reader());
  EXPECT_TRUE(reader_->Queries().empty());
  EXPECT_FALSE(reader_->Ask({.kind = Task::Kind::probe}, Instant()));
}

}  // namespace
}  // namespace baudgate::protocols

namespace baudgate::protocols::reader {
namespace {

TEST(ReaderRecognise, ReportsDeviationsFromTheConfiguration) {
  const struct {
    std::string form;
    std::string start;
    std::string end;
    std::string heard;
    std::string cause;
    std::string length = "0";
  } rows[] = {
      {"tag", "", "0x0D", "\n-06001259E3\n>", "its lines end in a line feed alone, not in CR LF"},
      {"tag", "", "0x0D", "4006381333931\r\n",
       "it sends text ('4006381333931'), but tags are configured"},
      {"tag", "", "0x0D", "\x07\x1b;h\x01", ""},
      {"text", "0x02", "0x03", "ST,+1.5kg\x03",
       "its messages do not begin with 0x02 ('ST,+1.5kg')"},
      {"text", "0x02", "0x03", "\x02ST,+1.5kg\r\n",
       "its messages do not end with 0x03 ('ST,+1.5kg')"},
      {"text", "", "0x0D", "4006381333931", "its messages have no end character ('4006381333931')"},
      {"text", "0x02", "0x03", "\x02ST,+1.5kg\x03", ""},
      {"text", "", "0x0D", "KJJJZk:", "the received bytes are not a message ('KJJJZk:')"},
      {"text", "]", "0x0D", "]40121443\r",
       "its messages have 8 characters (']40121443'), but the option length is 13", "13"},
      {"text", "4", "0x0D", "441230000162\r",
       "its messages have 11 characters ('441230000162'), but the option length is 12", "12"},
  };
  for (const auto& row : rows) {
    const config::Device device = Reader(
        {{"form", row.form}, {"start", row.start}, {"end", row.end}, {"length", row.length}});
    const auto found = Recognise({}, ToBytes(row.heard), ReadSettings(device.options));
    EXPECT_EQ(found ? found->cause : std::string(), row.cause) << row.heard;
    EXPECT_TRUE(!found || !found->remedy.empty());
  }
}

}  // namespace
}  // namespace baudgate::protocols::reader
