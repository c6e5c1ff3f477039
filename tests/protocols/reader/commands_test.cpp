// Tests a reader that answers commands: the requests, and to which command a message belongs.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "gateway/bus/poller/poller.h"
#include "protocols/reader/codec.h"
#include "protocols/reader/conversation.h"
#include "tests/protocols/reader/support.h"
#include "tests/support/virtual_line.h"

namespace baudgate::protocols {
namespace {

using protocols::reader::Command;
using protocols::reader::DecodeInformation;
using protocols::reader::EncodeCommand;

constexpr std::uint32_t kMessage = 7;
constexpr std::uint32_t kIdentity = 8;
const std::string kNoTag = "0000000000";
const std::string kA = "06001259E3";
const std::string kB = "0600125A00";

config::Device AskedReader(Duration poll = 10s) {
  config::Device device = Reader({{"commands", "ask"}});
  device.poll = poll;
  device.points.push_back(ReaderPoint("message", config::Type::string));
  device.points.push_back(ReaderPoint("identity", config::Type::string));
  return device;
}

std::string Information(const std::string& text) {
  const auto said = DecodeInformation(ToBytes(text));
  return said ? *said : "error: " + said.error();
}

TEST(ReaderCommands, AreOnlyReadAndInformation) {
  EXPECT_EQ(AsText(EncodeCommand(Command::read)), "r\r");
  EXPECT_EQ(AsText(EncodeCommand(Command::information)), "i\r");
  for (int any = 0; any < 256; ++any) {
    const Bytes bytes = EncodeCommand(static_cast<Command>(any));
    EXPECT_TRUE(AsText(bytes) == "r\r" || AsText(bytes) == "i\r") << any;
  }
}

TEST(ReaderCommands, InformationConsistsOfItsLines) {
  EXPECT_EQ(Information("\r\nMOD-RFID125-BOX\r\n>"), "MOD-RFID125-BOX");
  EXPECT_EQ(Information("\r\nMOD-RFID125-BOX\r\nVer 1.3\r\n>"), "MOD-RFID125-BOX Ver 1.3");
  EXPECT_EQ(Information(">i\r\nMOD-RFID125-BOX\r\n>"), "MOD-RFID125-BOX") << "it echoes";
  EXPECT_EQ(Information("\r\n>"), "error: an empty answer");
  EXPECT_EQ(Information("\r\n-06001x59E3\r\n>"), "error: the answer contains a damaged tag");
  EXPECT_NE(Information("\r\nMOD\xD2\r\n>"), "MOD\xD2");
}

class ReaderCommandsTest : public ::testing::Test {
 protected:
  explicit ReaderCommandsTest(config::Device device = AskedReader())
      : line_(GateLine(std::move(device)), {&ReaderProtocol()}) {
    line_.twin(0).manner.instead = [this](View request) -> std::optional<Bytes> {
      if (request[0] != 'r') return std::nullopt;
      return tag_.empty() ? Bytes() : TagFrame(tag_);
    };
  }
  std::string Events() const {
    std::string texts;
    for (const bus::ReportedEvents& reported : line_.events) {
      for (const DeviceEvent& event : reported.batch.events) texts += event.text + " ";
    }
    return texts;
  }
  std::size_t Reads() const { return line_.CountSent("r\r"); }
  void RunToRead() {
    const std::size_t before = Reads();
    ASSERT_TRUE(line_.RunUntil([&] { return Reads() > before; }, 1min));
  }
  std::string Shown(std::uint32_t point) const { return ToText(line_.ValueOf(0, point)); }

  std::string tag_ = kNoTag;  // reply of the reader to the command `r`; empty: silence
  VirtualLine line_;
};

TEST_F(ReaderCommandsTest, IdentityIsReadOnceAndTheTagAtEveryPoll) {
  line_.Open();
  line_.RunFor(65s);
  EXPECT_EQ(line_.CountSent("i\r"), 1U);
  EXPECT_GE(Reads(), 7U) << "every 10 s";
  EXPECT_LE(Reads(), 12U) << "and at first as a probe";
  EXPECT_EQ(line_.sent.size(), Reads() + 1) << "nothing else is sent";
  EXPECT_EQ(Shown(kIdentity), "MOD-RFID125-BOX");
  EXPECT_EQ(Shown(kMessage), kNoTag);
  EXPECT_EQ(Shown(kPresent), "false");
  EXPECT_EQ(line_.QualityOf(0, kTag), Quality::bad_waiting) << "no tag is no tag";
  EXPECT_EQ(line_.StatusOf(0).state, bus::DeviceState::online);
  EXPECT_TRUE(line_.events.empty());
  line_.Close();
  line_.RunFor(1min);
  line_.Open();
  line_.RunFor(1min);
  EXPECT_EQ(line_.CountSent("i\r"), 2U) << "it may be another one";
}

TEST_F(ReaderCommandsTest, AReadTagIsOneEventWhileItStays) {
  line_.Open();
  tag_ = kA;
  line_.RunFor(5min);
  EXPECT_EQ(Events(), kA + " ");
  EXPECT_EQ(Shown(kCounter), "1");
  EXPECT_LE(line_.AgeOf(0, kMessage), 11s);
  tag_ = kNoTag;
  line_.RunFor(1min);
  tag_ = kA;
  line_.RunFor(1min);
  EXPECT_EQ(Events(), kA + " " + kA + " ") << "it was away";
}

TEST_F(ReaderCommandsTest, ATagDuringACommandIsNotLostOrDuplicated) {
  line_.Open();
  line_.twin(0).manner.think = 30ms;
  line_.RunFor(5s);
  std::string expected;
  int number = 0;
  for (int after = 0; after <= 60; ++after) {
    const std::string tag = fmt::format("{:010X}", ++number);
    RunToRead();
    line_.Inject(TagFrame(tag), after * 1ms);
    tag_ = after % 2 == 0 ? tag : kNoTag;
    line_.RunFor(3s);
    expected += tag + " ";
    ASSERT_EQ(Events(), expected) << after << " ms";
    tag_ = kNoTag;
  }
  EXPECT_EQ(Shown(kCounter), std::to_string(number));
}

TEST_F(ReaderCommandsTest, AReturningTagNextToItsReplyIsReported) {
  line_.Open();
  line_.twin(0).manner.think = 30ms;
  line_.Inject(TagFrame(kA), 1s);
  tag_ = kA;
  line_.RunFor(30s);
  ASSERT_EQ(Events(), kA + " ");
  std::string expected = kA + " ";
  for (const Duration after : {1ms, 10ms, 70ms, 200ms}) {
    RunToRead();
    line_.Inject(TagFrame(kA), after);
    line_.RunFor(8s);
    ASSERT_EQ(Events(), expected += kA + " ") << after / 1ms;
  }
}

TEST_F(ReaderCommandsTest, ALateReplyIsNoTag) {
  line_.Open();
  tag_ = kA;
  line_.RunFor(30s);
  for (const Duration think : {900ms, 1100ms, 1500ms, 1900ms}) {
    line_.twin(0).manner.think = think;
    line_.RunFor(1min);
    line_.twin(0).manner.think = 5ms;
    line_.RunFor(1min);
    ASSERT_EQ(Events(), kA + " ") << think / 1ms;
  }
}

TEST_F(ReaderCommandsTest, SilenceOfAPolledReaderIsAnOutageButTagsAreAccepted) {
  line_.twin(0).manner.dead = true;
  line_.Open();
  line_.Inject(TagFrame(kA), 5s);
  line_.RunFor(6s);
  EXPECT_EQ(Events(), kA + " ");
  EXPECT_EQ(line_.QualityOf(0, kTag), Quality::good);
  line_.RunFor(5min);
  EXPECT_EQ(line_.StatusOf(0).state, bus::DeviceState::offline);
  line_.Inject(TagFrame(kB));
  line_.RunFor(1s);
  EXPECT_EQ(Events(), kA + " " + kB + " ");
  EXPECT_EQ(line_.QualityOf(0, kTag), Quality::good) << "what it says shows that it is there";
  line_.twin(0).manner.dead = false;
  line_.RunFor(3min);
  EXPECT_EQ(line_.QualityOf(0, kMessage), Quality::good) << "it is asked again";
  EXPECT_EQ(Events(), kA + " " + kB + " ");
}

TEST_F(ReaderCommandsTest, DamagedRepliesAreNoTags) {
  line_.Open();
  tag_ = kA;
  Bytes damaged;
  line_.twin(0).manner.distort = [&](Bytes reply) { return reply.size() == 16 ? damaged : reply; };
  const Bytes good = TagFrame(kA);
  for (std::size_t at = 0; at < 15; ++at) {
    damaged = good;
    damaged[at] ^= 0x80U;
    line_.RunFor(15s);
    ASSERT_EQ(Events(), "") << at;
    damaged = Bytes(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(at));
    line_.RunFor(15s);
    ASSERT_EQ(Events(), "") << at;
  }
  damaged = good;
  line_.RunFor(2min);
  EXPECT_EQ(Events(), kA + " ");
}

TEST_F(ReaderCommandsTest, InformationIsReadAtEveryCut) {
  const Bytes said = ToBytes("\r\nMOD-RFID125-BOX\r\nVer 1.3\r\n>");
  line_.twin(0).manner.instead = [&](View request) -> std::optional<Bytes> {
    return request[0] == 'i' ? said : TagFrame(kNoTag);
  };
  for (std::size_t fragment = 1; fragment <= said.size(); ++fragment) {
    line_.twin(0).manner.fragment = fragment;
    line_.twin(0).manner.pause = 10ms;
    line_.Open();
    line_.RunFor(5s);
    EXPECT_EQ(Shown(kIdentity), "MOD-RFID125-BOX Ver 1.3") << fragment;
    EXPECT_EQ(line_.QualityOf(0, kIdentity), Quality::good) << fragment;
    line_.Close();
    line_.RunFor(1min);
  }
  EXPECT_EQ(line_.StatusOf(0).Count(Outcome::corrupt), 0U);
  EXPECT_EQ(line_.StatusOf(0).Count(Outcome::partial), 0U);
}

TEST_F(ReaderCommandsTest, AReaderThatEchoesCommandsIsUnderstood) {
  line_.echo = [](View request) { return Bytes(request.begin(), request.end()); };
  line_.twin(0).manner.think = 300ms;
  line_.Open();
  line_.RunFor(5s);
  tag_ = kA;
  line_.RunFor(30s);
  EXPECT_EQ(Shown(kIdentity), "MOD-RFID125-BOX");
  EXPECT_EQ(Events(), kA + " ");
  EXPECT_EQ(line_.StatusOf(0).Count(Outcome::no_reply), 0U);
}

TEST_F(ReaderCommandsTest, ATagInsideTheInformationIsExtracted) {
  const std::string said = "\r\nMOD-RFID125-BOX\r\n>";
  std::string expected;
  for (std::size_t at = 0; at <= said.size(); ++at) {
    const std::string tag = fmt::format("{:010X}", at + 1);
    line_.twin(0).manner.instead = [&](View request) -> std::optional<Bytes> {
      if (request[0] != 'i') return TagFrame(kNoTag);
      std::string mixed = said;
      return ToBytes(mixed.insert(at, AsText(TagFrame(tag))));
    };
    line_.Open();
    line_.RunFor(5s);
    ASSERT_EQ(Events(), expected += tag + " ") << at;
    ASSERT_EQ(Shown(kIdentity), "MOD-RFID125-BOX") << at;
    line_.Close();
    line_.RunFor(1min);
  }
}

TEST_F(ReaderCommandsTest, APortLostInsideAReplyDuplicatesNoTag) {
  line_.Open();
  line_.Inject(TagFrame(kA), 1s);
  tag_ = kA;
  line_.RunFor(20s);
  for (const Duration lost : {10ms, 20ms, 35ms, 45ms, 100ms}) {
    RunToRead();
    line_.twin(0).manner.think = 30ms;
    line_.RunFor(lost);
    line_.Close();
    line_.RunFor(500ms);
    line_.Open();
    line_.RunFor(1min);
    ASSERT_EQ(Events(), kA + " ") << lost / 1ms;
    ASSERT_EQ(Shown(kMessage), kA);
    ASSERT_EQ(line_.QualityOf(0, kMessage), Quality::good);
    ASSERT_LE(line_.AgeOf(0, kMessage), 11s);
  }
}

TEST_F(ReaderCommandsTest, AReadOnDemandReturnsTheCurrentTag) {
  line_.Open();
  line_.RunFor(2s);
  WriteResult result;
  const auto read = [&](std::uint32_t point) {
    bus::WriteCommand command;
    command.device = 0;
    command.kind = bus::Reads{{point}};
    command.deadline = line_.now().instant + 10s;
    command.done = [&](const WriteResult& its) { result = its; };
    line_.Submit(std::move(command));
    line_.RunFor(1s);
  };
  tag_ = kA;
  read(kMessage);
  EXPECT_EQ(result.end, WriteEnd::ok) << result.reason;
  EXPECT_EQ(Shown(kMessage), kA);
  EXPECT_LE(line_.AgeOf(0, kMessage), 1s);
  read(kTag);
  EXPECT_EQ(result.end, WriteEnd::not_sent) << "reading does not renew it";
}

/// On a pty or a network, the reply arrives before the computed end of the command.
class ReaderOnAFastPort : public ReaderCommandsTest {
 protected:
  ReaderOnAFastPort() { line_.keeps_bit_rate = false; }
};

TEST_F(ReaderOnAFastPort, AnImmediateReplyIsAccepted) {
  line_.twin(0).manner.deliver = [](View, Bytes reply, Instant) {
    return std::vector<tools::TimedPiece>{{-1ms, std::move(reply)}};
  };
  line_.Open();
  line_.RunFor(1min);
  EXPECT_EQ(line_.StatusOf(0).Count(Outcome::no_reply), 0U);
  EXPECT_EQ(line_.StatusOf(0).state, bus::DeviceState::online);
}

}  // namespace
}  // namespace baudgate::protocols
