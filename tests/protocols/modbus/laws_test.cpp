// The laws of frame rules for Modbus RTU, ASCII and TCP, requests and replies, and what they owe
// beyond.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/rules.h"
#include "tests/laws/frame_rule_laws.h"
#include "tests/protocols/modbus/support.h"

namespace baudgate {
namespace {

using protocols::modbus::Framing;
using protocols::modbus::Hex;
using protocols::modbus::Unwrap;
using protocols::modbus::Wrap;

Bytes Frame(Framing framing, const char* pdu) { return Wrap(framing, 20, Hex(pdu)); }

/// Essence of an ASCII frame: what its digits mean, in either case.
Bytes Meaning(View frame) {
  const auto adu = Unwrap(Framing::ascii, frame);
  Bytes bytes = {adu ? adu->slave : std::uint8_t{0}};
  if (adu) Append(bytes, adu->pdu);
  return bytes;
}

/// Noise with many bytes that a frame could begin with.
Bytes RtuGarbage(std::mt19937& random) {
  constexpr std::uint8_t kLikely[] = {20, 3, 6, 16, 8, 0x83, 2, 0, 23, 43, 1};
  Bytes bytes(random() % 40);
  for (std::uint8_t& byte : bytes) {
    byte = random() % 2 == 0 ? kLikely[random() % std::size(kLikely)]
                             : static_cast<std::uint8_t>(random());
  }
  return bytes;
}

Bytes AsciiGarbage(std::mt19937& random) {
  constexpr std::string_view kText = "0123456789ABCDEF:\n\r3140";
  Bytes bytes(random() % 40);
  for (std::uint8_t& byte : bytes) {
    byte = random() % 8 == 0 ? static_cast<std::uint8_t>(random())
                             : static_cast<std::uint8_t>(kText[random() % kText.size()]);
  }
  return bytes;
}

void SetFraming(LawSubject& subject, Framing framing) {
  subject.garbage = framing == Framing::rtu ? RtuGarbage : AsciiGarbage;
  if (framing == Framing::ascii) subject.essence = Meaning;
}

LawSubject Requests(Framing framing) {
  LawSubject subject;
  subject.name = framing == Framing::rtu ? "RtuRequests" : "AsciiRequests";
  subject.rule = protocols::modbus::ProtocolOf(framing).request_rule;
  subject.expect = protocols::modbus::Expect(framing, {});
  for (const char* pdu :
       {"0100000010", "0200050001", "0301F40001", "0400000078", "050003FF00", "0600080002",
        "080000A55A", "08000B0000", "0F0013000A02CD01", "1003E70002040005000A", "16000400F20025",
        "1700000002000A0001020005", "2B0E0100", "0800000102030405", "640102030405"}) {
    subject.frames.push_back(Frame(framing, pdu));
  }
  SetFraming(subject, framing);
  // An RTU frame begins after silence, or behind another one: rtu_request_rule_test.cpp.
  subject.found_behind_garbage = framing == Framing::ascii;
  return subject;
}

/// One subject for each request, because a reply is cut by what was asked.
LawSubject Replies(Framing framing, const char* name, const char* request,
                   std::vector<const char*> replies) {
  LawSubject subject;
  subject.name = std::string(framing == Framing::rtu ? "Rtu" : "Ascii") + name;
  subject.rule = protocols::modbus::ProtocolOf(framing).reply_rule;
  subject.expect = protocols::modbus::Expect(framing, Frame(framing, request));
  for (const char* reply : replies) subject.frames.push_back(Frame(framing, reply));
  SetFraming(subject, framing);
  return subject;
}

/// Headers that were cut, wrong protocols and lengths.
Bytes TcpGarbage(std::mt19937& random) {
  Bytes bytes(random() % 40);
  for (std::uint8_t& byte : bytes) {
    byte = random() % 2 == 0 ? std::uint8_t{0} : static_cast<std::uint8_t>(random());
  }
  return bytes;
}

LawSubject TcpSubject(const char* name, const char* request, std::vector<const char*> frames) {
  LawSubject subject;
  subject.name = name;
  const Protocol& protocol = protocols::modbus::ProtocolOf(Framing::tcp);
  subject.rule = *request == 0 ? protocol.request_rule : protocol.reply_rule;
  subject.expect = protocols::modbus::Expect(Framing::tcp, Hex(request));
  for (const char* frame : frames) subject.frames.push_back(Hex(frame));
  subject.garbage = TcpGarbage;
  subject.checksum = false;
  subject.found_behind_garbage = false;
  return subject;
}

std::vector<LawSubject> TcpSubjects() {
  constexpr const char* kRead500 = "00 01 00 00 00 06 14 03 01 F4 00 01";
  return {
      TcpSubject(
          "TcpRequests", "",
          {kRead500, "FF FF 00 00 00 06 FF 06 00 08 00 02", "00 02 00 00 00 05 00 2B 0E 01 00",
           "00 03 00 00 00 02 01 07", "00 04 00 00 00 06 01 08 00 00 A5 5A"}),
      TcpSubject("TcpRegister", kRead500,
                 {"00 01 00 00 00 05 14 03 02 00 31", "00 01 00 00 00 03 14 83 02"}),
      TcpSubject("TcpWrite", "12 34 00 00 00 06 01 06 00 01 00 03",
                 {"12 34 00 00 00 06 01 06 00 01 00 03", "12 34 00 00 00 03 01 86 02"}),
      TcpSubject("TcpUnknown", "00 09 00 00 00 04 01 64 01 02",
                 {"00 09 00 00 00 07 01 64 05 04 03 02 01", "00 09 00 00 00 03 01 E4 01"}),
  };
}

std::vector<LawSubject> Subjects() {
  std::vector<LawSubject> subjects = TcpSubjects();
  for (const Framing framing : {Framing::rtu, Framing::ascii}) {
    subjects.push_back(Requests(framing));
    subjects.push_back(Replies(framing, "Coils", "0100000012", {"0103CD6B02", "8101"}));
    subjects.push_back(
        Replies(framing, "Register", "0301F40001", {"03020031", "030209C4", "8302"}));
    subjects.push_back(
        Replies(framing, "Registers", "0400000004", {"04080001000200030004", "8404"}));
    subjects.push_back(Replies(framing, "Write", "0600080002", {"0600080002", "8603"}));
    subjects.push_back(Replies(framing, "Block", "1003E70001020005", {"1003E70001", "9006"}));
    subjects.push_back(Replies(framing, "Mask", "16000400F20025", {"16000400F20025", "9601"}));
    subjects.push_back(Replies(framing, "Loopback", "080000A55A", {"080000A55A", "8801"}));
    subjects.push_back(
        Replies(framing, "Identity", "2B0E0100", {"2B0E01810000020003414243010158", "AB01"}));
    subjects.push_back(Replies(framing, "Unknown", "640102", {"640504030201", "E401"}));
  }
  return subjects;
}

using ::testing::ValuesIn;
INSTANTIATE_TEST_SUITE_P(Modbus, FrameRuleLaws, ValuesIn(Subjects()), LawSubjectName);
INSTANTIATE_TEST_SUITE_P(Modbus, ChecksumLaws, ValuesIn(WithChecksum(Subjects())), LawSubjectName);
INSTANTIATE_TEST_SUITE_P(Modbus, GarbageLaws, ValuesIn(FoundBehindGarbage(Subjects())),
                         LawSubjectName);

// ---------------------------------------------------------------- replies

struct Cutter {
  explicit Cutter(const char* request, Framing framing = Framing::rtu) {
    assembler.Begin(protocols::modbus::ProtocolOf(framing).reply_rule,
                    protocols::modbus::Expect(framing, Frame(framing, request)));
  }
  std::optional<Bytes> Take(View bytes, bool idle = false) {
    assembler.Feed(bytes);
    return assembler.Next(idle);
  }
  Assembler assembler;
};

TEST(ModbusRtuReplyRule, AFrameIsWholeWithItsLastByte) {
  Cutter cutter("0301F40001");
  const Bytes reply = Hex("14 03 02 00 31 74 53");
  for (std::size_t i = 0; i + 1 < reply.size(); ++i) {
    EXPECT_FALSE(cutter.Take(View(reply).subspan(i, 1)).has_value());
  }
  EXPECT_EQ(cutter.Take(View(reply).last(1)), std::optional(reply)) << "no silence is waited for";
  Cutter refused("0301F40001");
  EXPECT_EQ(refused.Take(Hex("14 83 02 D1 35")), std::optional(Hex("14 83 02 D1 35")));
}

TEST(ModbusRtuReplyRule, ALongReplyInFragmentsIsOneFrame) {
  Cutter cutter("0303E70078");
  Bytes pdu = Hex("03F0");
  for (int i = 0; i < 240; ++i) pdu.push_back(static_cast<std::uint8_t>(i));
  const Bytes reply = Wrap(Framing::rtu, 20, pdu);
  ASSERT_EQ(reply.size(), 245U);
  EXPECT_FALSE(cutter.Take(View(reply).first(16)).has_value());
  EXPECT_FALSE(cutter.Take(View(reply).subspan(16, 200)).has_value());
  EXPECT_EQ(cutter.Take(View(reply).subspan(216)), std::optional(reply));
}

TEST(ModbusRtuReplyRule, AnotherSlavesReplyIsPassedOver) {
  Cutter cutter("0301F40001");
  Bytes stream = Wrap(Framing::rtu, 21, Hex("03020099"));
  EXPECT_FALSE(cutter.Take(stream).has_value());
  EXPECT_EQ(cutter.assembler.blame(), Outcome::unexpected);
  EXPECT_TRUE(cutter.Take(Hex("14 03 02 00 31 74 53")).has_value());
}

/// A device that answers late: what it says is for the conversation to tell.
TEST(ModbusReplyRules, AReplyOfAnotherFormIsAFrame) {
  for (const Framing framing : {Framing::rtu, Framing::ascii}) {
    for (const char* pdu : {"030400310032", "080000A55A", "04020031", "8402", "0600080002"}) {
      Cutter cutter("0301F40001", framing);
      const Bytes reply = Frame(framing, pdu);
      EXPECT_EQ(cutter.Take(reply), std::optional(reply)) << pdu;
    }
  }
}

TEST(ModbusRtuReplyRule, AnEchoOfAReadIsNoReply) {
  Cutter cutter("0301F40001");
  EXPECT_EQ(cutter.Take(Hex("14 03 01 F4 00 01 C6 C1 14 03 02 00 31 74 53")),
            std::optional(Hex("14 03 02 00 31 74 53")));
}

TEST(ModbusRtuReplyRule, BlamesDamageSilenceAndNoiseApart) {
  const auto blame = [](const char* wire) {
    Cutter cutter("0301F40001");
    EXPECT_FALSE(cutter.Take(Hex(wire), true).has_value()) << wire;
    return cutter.assembler.blame();
  };
  EXPECT_EQ(blame("14 03 02 00 31 74 54"), Outcome::corrupt);
  EXPECT_EQ(blame("14 03 02 00 31 74"), Outcome::partial);
  EXPECT_EQ(blame("00 FF 00"), Outcome::none);
  EXPECT_EQ(blame("55 55"), Outcome::partial);
}

TEST(ModbusRtuReplyRule, AnUnknownFunctionIsEndedBySilence) {
  Cutter cutter("640102");
  const Bytes reply = Frame(Framing::rtu, "640504030201");
  EXPECT_FALSE(cutter.Take(reply).has_value());
  EXPECT_EQ(cutter.Take({}, true), std::optional(reply));
}

TEST(ModbusAsciiReplyRule, AMissingLineFeedIsFoundBySilence) {
  Cutter cutter("0301F40001", Framing::ascii);
  EXPECT_FALSE(cutter.Take(ToBytes(":1403020031B6\r")).has_value());
  EXPECT_EQ(cutter.Take({}, true), std::optional(ToBytes(":1403020031B6\r")));
}

TEST(ModbusAsciiReplyRule, AColonBeginsAnew) {
  Cutter cutter("0301F40001", Framing::ascii);
  EXPECT_EQ(cutter.Take(ToBytes(":140302:1403020031b6\r\n")),
            std::optional(ToBytes(":1403020031b6\r\n")));
}

TEST(ModbusAsciiReplyRule, OtherSlavesAndEchoesArePassedOver) {
  Cutter cutter("0301F40001", Framing::ascii);
  EXPECT_FALSE(cutter.Take(Wrap(Framing::ascii, 21, Hex("03020031"))).has_value());
  EXPECT_FALSE(cutter.Take(Frame(Framing::ascii, "0301F40001")).has_value()) << "an echo";
  EXPECT_TRUE(cutter.Take(Frame(Framing::ascii, "03020031")).has_value());
}

TEST(ModbusAsciiReplyRule, NothingLongerThanAFrameIsHeld) {
  Cutter cutter("0301F40001", Framing::ascii);
  EXPECT_FALSE(cutter.Take(ToBytes(":" + std::string(510, '0'))).has_value());
  EXPECT_EQ(cutter.assembler.held(), 511U);
  EXPECT_FALSE(cutter.Take(ToBytes("00")).has_value());
  EXPECT_EQ(cutter.assembler.held(), 0U);
}

}  // namespace
}  // namespace baudgate
