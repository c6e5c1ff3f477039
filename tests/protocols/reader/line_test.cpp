// Tests a reader on its line in virtual time: from bytes to values, events and status.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/bus/jobs/unasked.h"
#include "gateway/bus/poller/poller.h"
#include "tests/protocols/reader/support.h"
#include "tests/support/virtual_line.h"

namespace baudgate::protocols {
namespace {

std::string Digits(int tag) {
  std::string digits = std::to_string(tag);
  return digits.insert(0, 10 - digits.size(), '0');
}

class ReaderLineTest : public ::testing::Test {
 protected:
  explicit ReaderLineTest(config::Device device = Reader())
      : line_(GateLine(std::move(device)), {&ReaderProtocol()}) {}

  std::string Events() const {
    std::string texts;
    for (const bus::ReportedEvents& reported : line_.events) {
      for (const DeviceEvent& event : reported.batch.events) texts += event.text + " ";
    }
    return texts;
  }

  VirtualLine line_;
};

TEST_F(ReaderLineTest, ATagGivesValuesAndAnEvent) {
  line_.Open();
  line_.RunFor(3h);
  EXPECT_EQ(line_.QualityOf(0, kTag), Quality::bad_waiting) << "never read, and nothing like a 0";
  EXPECT_EQ(line_.StatusOf(0).state, bus::DeviceState::never_seen);
  EXPECT_TRUE(line_.StatusOf(0).unasked);
  line_.Inject(TagFrame("06001259E3"), 10ms);
  line_.RunFor(1s);
  EXPECT_EQ(ToText(line_.ValueOf(0, kTag)), "06001259E3");
  EXPECT_EQ(line_.QualityOf(0, kTag), Quality::good);
  EXPECT_EQ(line_.AgeOf(0, kTag), 990ms);
  EXPECT_EQ(ToText(line_.ValueOf(0, kPresent)), "true");
  EXPECT_EQ(Events(), "06001259E3 ");
  EXPECT_EQ(line_.StatusOf(0).state, bus::DeviceState::online);
  EXPECT_TRUE(line_.sent.empty()) << "nothing is ever sent";
}

TEST(ReaderLine, ALetterBeyondAsciiIsNoParityBit) {
  const struct {
    std::string text;
    Symptom symptom;
  } rows[] = {{"Kunde M\xFCller 12\r", Symptom::other_setting},
              {"\xB4\xB0\xB1\xB2\xB3\xB0\xB0\xB0\x8D", Symptom::eighth_bit},
              {"\xB4\x30\xB1\xB2\x33\x30\x30\x30\x8D", Symptom::eighth_bit}};
  for (const auto& row : rows) {
    VirtualLine line(GateLine(Reader({{"form", "text"}})), {&ReaderProtocol()});
    line.Open();
    line.RunFor(1s);
    line.Inject(ToBytes(row.text));
    line.RunFor(1s);
    EXPECT_EQ(line.StatusOf(0).findings.Count(row.symptom), 1U) << row.text;
  }
}

TEST(ReaderLine, TelnetNegotiationOfAServerIsCounted) {
  config::Line gate = GateLine(Reader());
  gate.port = "tcp://10.0.0.9:4001";
  VirtualLine line(std::move(gate), {&ReaderProtocol()});
  line.Open();
  line.Inject(Bytes{0xFF, 0xFB, 0x01, 0xFF, 0xFB, 0x03});
  line.RunFor(1s);
  EXPECT_EQ(line.store().ReadLine(0).negotiations, 1U);
}

TEST_F(ReaderLineTest, SilenceIsNormal) {
  line_.Open();
  line_.Inject(TagFrame("06001259E3"));
  line_.RunFor(std::chrono::hours(24 * 30));
  EXPECT_EQ(line_.StatusOf(0).state, bus::DeviceState::online);
  EXPECT_EQ(line_.QualityOf(0, kTag), Quality::good);
  EXPECT_EQ(ToText(line_.ValueOf(0, kPresent)), "false") << "after 2 s";
  EXPECT_EQ(line_.StatusOf(0).Count(Outcome::no_reply), 0U);
  EXPECT_TRUE(line_.sent.empty());
  EXPECT_TRUE(line_.warnings.empty());
}

TEST_F(ReaderLineTest, ATagIsReadAtEveryCut) {
  line_.Open();
  const Bytes frame = TagFrame("06001259E3");
  int tags = 0;
  for (std::size_t i = 0; i <= frame.size(); ++i) {
    for (std::size_t j = i; j <= frame.size(); ++j) {
      const Bytes tag = TagFrame(Digits(++tags));
      line_.Inject(Bytes(tag.begin(), tag.begin() + static_cast<std::ptrdiff_t>(i)), 1ms);
      line_.Inject(Bytes(tag.begin() + static_cast<std::ptrdiff_t>(i),
                         tag.begin() + static_cast<std::ptrdiff_t>(j)),
                   20ms);
      line_.Inject(Bytes(tag.begin() + static_cast<std::ptrdiff_t>(j), tag.end()), 40ms);
      line_.RunFor(1s);
      ASSERT_EQ(ToText(line_.ValueOf(0, kTag)), Digits(tags)) << i << " " << j;
    }
  }
  EXPECT_EQ(line_.StatusOf(0).Count(Outcome::ok), static_cast<std::uint32_t>(tags));
  EXPECT_EQ(line_.StatusOf(0).Count(Outcome::corrupt), 0U);
  EXPECT_EQ(line_.events.size(), static_cast<std::size_t>(tags));
}

TEST_F(ReaderLineTest, TwoTagsInOnePieceAreTwoEvents) {
  line_.Open();
  Bytes both = TagFrame("0000000001");
  Append(both, TagFrame("0000000002"));
  line_.Inject(both);
  line_.RunFor(1s);
  EXPECT_EQ(Events(), "0000000001 0000000002 ");
  EXPECT_EQ(ToText(line_.ValueOf(0, kCounter)), "2");
  EXPECT_EQ(ToText(line_.ValueOf(0, 6)), "0000000001") << "the one before";
}

TEST_F(ReaderLineTest, ADamagedTagIsCountedAndDropped) {
  line_.Open();
  Bytes damaged = TagFrame("0000000001");
  damaged[7] ^= 0x80U;
  line_.Inject(damaged);
  line_.RunFor(1s);
  EXPECT_EQ(line_.QualityOf(0, kTag), Quality::bad_waiting);
  EXPECT_EQ(line_.StatusOf(0).Count(Outcome::corrupt), 1U);
  line_.Inject(TagFrame("0000000002"));
  line_.RunFor(1s);
  EXPECT_EQ(Events(), "0000000002 ");
}

TEST_F(ReaderLineTest, ALostPortDropsHalfATag) {
  line_.Open();
  line_.Inject(TagFrame("0000000001"));
  line_.RunFor(1s);
  Bytes half = TagFrame("0000000002");
  half.resize(8);
  line_.Inject(half);
  line_.RunFor(10ms);
  line_.Close();
  line_.RunFor(1min);
  EXPECT_EQ(line_.QualityOf(0, kTag), Quality::bad_not_connected);
  EXPECT_EQ(line_.StatusOf(0).state, bus::DeviceState::offline);
  line_.Open();
  line_.RunFor(1min);
  EXPECT_EQ(line_.QualityOf(0, kTag), Quality::uncertain) << "tags may have passed meanwhile";
  EXPECT_EQ(line_.StatusOf(0).state, bus::DeviceState::online) << "its silence is no outage";
  EXPECT_EQ(ToText(line_.ValueOf(0, kPresent)), "false");
  const Bytes rest = TagFrame("0000000002");
  line_.Inject(Bytes(rest.begin() + 8, rest.end()));
  line_.Inject(TagFrame("0000000001"), 100ms);
  line_.RunFor(1s);
  EXPECT_EQ(Events(), "0000000001 0000000001 ");
  EXPECT_EQ(line_.QualityOf(0, kTag), Quality::good);
  EXPECT_EQ(ToText(line_.ValueOf(0, kCounter)), "2");
}

TEST_F(ReaderLineTest, ADisabledReaderIsIgnored) {
  line_.Open();
  line_.poller().SetInUse(0, false, line_.now());
  line_.Inject(TagFrame("0000000001"));
  line_.RunFor(1s);
  EXPECT_TRUE(line_.events.empty());
  line_.poller().SetInUse(0, true, line_.now());
  line_.Inject(TagFrame("0000000002"));
  line_.RunFor(1s);
  EXPECT_EQ(Events(), "0000000002 ");
}

TEST_F(ReaderLineTest, AReadOnDemandOfAnUnaskedReaderIsRefused) {
  line_.Open();
  WriteResult result;
  bus::WriteCommand command;
  command.device = 0;
  command.kind = bus::Reads{{kTag}};
  command.deadline = line_.now().instant + 1s;
  command.done = [&](const WriteResult& its) { result = its; };
  line_.Submit(std::move(command));
  EXPECT_EQ(result.end, WriteEnd::not_sent);
  EXPECT_EQ(result.reason,
            "this device cannot be polled, because it sends by itself; its last message is shown");
}

TEST_F(ReaderLineTest, NumbersContinueAfterARestart) {
  line_.Open();
  line_.Inject(TagFrame("0000000001"));
  line_.RunFor(1s);
  line_.said = [](std::uint32_t) { return std::string("1"); };
  line_.Restart();
  line_.Inject(TagFrame("0000000002"));
  line_.RunFor(1s);
  EXPECT_EQ(ToText(line_.ValueOf(0, kCounter)), "2");
}

TEST_F(ReaderLineTest, WaitingEventsAreBoundedAndLostEventsAreReported) {
  bool works = false;
  std::size_t kept = 0;
  std::string told;
  line_.keep = [&](const bus::ReportedEvents& reported) {
    if (!works) return false;
    ++kept;
    for (const DeviceEvent& event : reported.batch.events) {
      if (event.code == 0) told = event.text;
    }
    return true;
  };
  line_.keep_time = 1ms;
  line_.Open();
  constexpr int kTags = 1200;
  for (int tag = 1; tag <= kTags; ++tag) line_.Inject(TagFrame(Digits(tag)), tag * 17ms);
  line_.RunFor(kTags * 17ms + 1s);
  EXPECT_EQ(line_.StatusOf(0).lost_events, kTags - bus::EventBacklog::kMost);
  EXPECT_EQ(line_.warnings.size(), 1U);
  EXPECT_EQ(ToText(line_.ValueOf(0, kCounter)), std::to_string(kTags)) << "values are those of now";
  works = true;
  line_.RunFor(10s);
  EXPECT_EQ(kept, bus::EventBacklog::kMost);
  line_.Inject(TagFrame(Digits(5000)));
  line_.RunFor(1s);
  EXPECT_EQ(kept, bus::EventBacklog::kMost + 1);
  EXPECT_EQ(told, "lost before this event, because the disk failed: 200 events");
}

class WeighingTest : public ReaderLineTest {
 protected:
  WeighingTest() : ReaderLineTest(Indicator()) {}
  static config::Device Indicator() {
    config::Device device = Reader({{"form", "text"}});
    device.events = false;
    device.max_age = 1s;
    device.dead_age = 10s;
    device.points = {ReaderPoint("number", config::Type::float32)};
    return device;
  }
};

TEST_F(WeighingTest, AWeightAgesIfConfigured) {
  line_.Open();
  line_.RunFor(1s);
  line_.Inject(ToBytes("ST,GS,+  12.35kg\r\n"));
  line_.RunFor(500ms);
  EXPECT_EQ(ToText(line_.ValueOf(0, 0)), "12.35");
  EXPECT_EQ(line_.QualityOf(0, 0), Quality::good);
  line_.RunFor(1s);
  EXPECT_EQ(line_.QualityOf(0, 0), Quality::uncertain_last_usable);
  line_.RunFor(10s);
  EXPECT_EQ(line_.QualityOf(0, 0), Quality::bad_communication);
}

/// The port opens during "112.35". The rest, "2.35", would be a wrong weight.
TEST_F(WeighingTest, AMessageBegunBeforeThePortOpenedIsDropped) {
  line_.Open();
  line_.Inject(ToBytes("2.35kg\r\n"), 5ms);
  line_.Inject(ToBytes("112.40kg\r\n"), 30ms);
  line_.RunFor(10ms);
  EXPECT_EQ(line_.QualityOf(0, 0), Quality::bad_waiting);
  line_.RunFor(100ms);
  EXPECT_EQ(ToText(line_.ValueOf(0, 0)), "112.4");
}

}  // namespace
}  // namespace baudgate::protocols
