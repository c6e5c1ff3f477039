// Tests the requests of a master on a bus with other slaves: the gateway accepts every request,
// skips the replies of other slaves, and executes no request that is part of another message.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "protocols/modbus/rules.h"
#include "tests/laws/frame_rule_laws.h"
#include "tests/protocols/modbus/support.h"

namespace baudgate::protocols::modbus {
namespace {

using Frames = std::vector<Bytes>;

constexpr std::size_t kPieces[] = {1, 2, 3, 7, 8, 16, 1000};
constexpr std::uint8_t kOther = 77;
constexpr std::uint8_t kFillers[] = {0x00, 0xFF, 0x01, 0x03, 0x64};

const Bytes kWrite = Hex("01 06 04 D2 10 E1 E5 4B");
const Bytes kRead = Hex("14 03 01 F4 00 01 C6 C1");

Bytes Rtu(std::uint8_t slave, std::string_view pdu) { return Wrap(Framing::rtu, slave, Hex(pdu)); }

Bytes ReadReply(View data, std::uint8_t slave = kOther) {
  Bytes pdu = {kReadHolding, static_cast<std::uint8_t>(data.size())};
  Append(pdu, data);
  return Wrap(Framing::rtu, slave, pdu);
}

Bytes Joined(const std::vector<Bytes>& parts) {
  Bytes all;
  for (const Bytes& part : parts) Append(all, View(part));
  return all;
}

class Listener {
 public:
  Listener() { assembler_.Begin(RtuRequestRule, Expect(Framing::rtu, {})); }

  void Hear(View bytes) {
    assembler_.Feed(bytes);
    Take(false);
    EXPECT_LE(assembler_.held(), kMaxRtu);
  }
  void HearInPieces(View bytes, std::size_t size) {
    for (; !bytes.empty(); bytes = bytes.subspan(std::min(size, bytes.size()))) {
      Hear(bytes.first(std::min(size, bytes.size())));
    }
  }
  void Silence() {
    Take(true);
    EXPECT_EQ(assembler_.held(), 0U);
  }

  const Frames& frames() const { return frames_; }
  bool Executed(const Bytes& frame) const { return std::ranges::count(frames_, frame) > 0; }
  Outcome blame() const { return assembler_.blame(); }

 private:
  void Take(bool idle) {
    while (auto frame = assembler_.Next(idle)) frames_.push_back(std::move(*frame));
  }

  Assembler assembler_;
  Frames frames_;
};

Listener Heard(View bytes, std::size_t piece = 1000) {
  Listener listener;
  listener.HearInPieces(bytes, piece);
  listener.Silence();
  return listener;
}

TEST(ModbusRtuRequestRule, RepliesOfOtherSlavesDoNotHideTheNextRequest) {
  for (const char* other : {"030209C4", "0102CD6B", "8302", "1003E70078", "0F0013000A",
                            "170400010002", "2B0E0181000001000141", "0308000100020003FFFF"}) {
    for (const std::size_t piece : kPieces) {
      const Listener glued = Heard(Joined({Rtu(7, other), kRead}), piece);
      EXPECT_EQ(glued.frames(), Frames{kRead}) << other;
      EXPECT_EQ(glued.blame(), Outcome::none) << other << ": a good frame is no damage";

      Listener apart = Heard(Rtu(7, other), piece);
      EXPECT_TRUE(apart.frames().empty()) << other;
      EXPECT_EQ(apart.blame(), Outcome::none) << other;
      apart.Hear(kRead);
      EXPECT_EQ(apart.frames(), Frames{kRead}) << other;
    }
  }
}

TEST(ModbusRtuRequestRule, RepliesInAnyPiecesAreNoDamage) {
  for (const std::size_t registers : {2U, 3U, 10U, 60U, 120U, 125U}) {
    Bytes data;
    for (std::size_t i = 0; i < registers; ++i) AppendU16(data, 1000 + 7 * i);
    for (const std::size_t piece : kPieces) {
      Listener listener;
      listener.HearInPieces(ReadReply(data), piece);
      EXPECT_EQ(listener.blame(), Outcome::none) << registers << " registers by " << piece;
      listener.Hear(kRead);
      EXPECT_EQ(listener.frames(), Frames{kRead}) << "at once, after " << registers;
    }
  }
}

TEST(ModbusRtuRequestRule, RepliesInterruptedBySilenceAreOnlyDamage) {
  for (const std::size_t registers : {2U, 10U, 60U, 120U}) {
    Bytes data;
    for (std::size_t i = 0; i < registers; ++i) AppendU16(data, 1000 + 7 * i);
    for (const std::size_t piece : kPieces) {
      Listener listener;
      const Bytes reply = ReadReply(data);
      for (std::size_t at = 0; at < reply.size(); at += piece) {
        listener.Hear(View(reply).subspan(at, std::min(piece, reply.size() - at)));
        listener.Silence();
      }
      EXPECT_TRUE(listener.frames().empty()) << registers << " registers by " << piece;
      EXPECT_EQ(listener.blame() == Outcome::none, piece >= reply.size());
      listener.Hear(kRead);
      EXPECT_EQ(listener.frames(), Frames{kRead});
    }
  }
}

TEST(ModbusRtuRequestRule, AllRequestsOfAContinuousStreamAreFound) {
  const std::pair<const char*, const char*> exchanges[] = {
      {"0300C80002", "030409C400CA"},
      {"0100000010", "0102CD6B"},
      {"0600080002", "8602"},
      {"1003E700020400010002", "1003E70002"},
      {"0F0013000A02CD01", "0F0013000A"},
      {"1700000002000A0001020005", "170400010002"},
      {"2B0E0100", "2B0E0181000001000141"},
      {"07", "076D"},
      {"0B", "0BFFFF0108"},
      {"11", "110407FF4142"},
      {"140706000400010002", "140605060DFE0020"},
      {"1804DE", "180006000201B81284"},
  };
  Bytes stream;
  Frames requests;
  for (const auto& [request, reply] : exchanges) {
    for (const Bytes& frame : {Rtu(kOther, request), kRead}) requests.push_back(frame);
    Append(stream, View(Joined({Rtu(kOther, request), Rtu(kOther, reply), kRead})));
  }
  for (const std::size_t piece : kPieces) {
    const Listener listener = Heard(stream, piece);
    EXPECT_EQ(listener.frames(), requests) << "by " << piece;
    EXPECT_EQ(listener.blame(), Outcome::none) << "by " << piece;
  }
}

TEST(ModbusRtuRequestRule, FramesOfUnknownFunctionsAreSeparatedAtSilence) {
  const Bytes request = Rtu(kOther, "42");
  const Bytes reply = Wrap(Framing::rtu, kOther, Joined({Hex("42 0A 01 FF"), kWrite}));
  for (const std::size_t piece : kPieces) {
    const Listener glued = Heard(Joined({request, reply, kRead}), piece);
    EXPECT_EQ(glued.frames(), (Frames{request, reply, kRead})) << "by " << piece;
    EXPECT_EQ(glued.blame(), Outcome::none);
    const Listener noisy = Heard(Joined({request, Hex("FF"), reply, kRead, Hex("00")}), piece);
    EXPECT_EQ(noisy.frames(), (Frames{request, reply, kRead})) << "by " << piece;
  }
  Bytes stream = Joined({request, reply});
  Frames expected = {request, reply};
  while (expected.size() < 60) {
    Append(stream, View(kRead));
    expected.push_back(kRead);
  }
  EXPECT_EQ(Heard(stream).frames(), expected) << "without any silence, more than a frame is long";
}

TEST(ModbusRtuRequestRule, AnInconsistentWriteEndsAtSilence) {
  for (const char* pdu : {"1003E70003020005", "17F00001000A0001030005"}) {
    const Bytes odd = Rtu(20, pdu);
    Listener listener;
    listener.Hear(odd);
    EXPECT_TRUE(listener.frames().empty());
    listener.Silence();
    EXPECT_EQ(listener.frames(), Frames{odd}) << "the slave refuses it";
  }
}

TEST(ModbusRtuRequestRule, ALoopbackDoesNotWaitForSilence) {
  const Bytes loopback = Rtu(20, "080000A55A");
  Listener listener;
  listener.Hear(loopback);
  EXPECT_EQ(listener.frames(), Frames{loopback});
}

TEST(ModbusRtuRequestRule, ARequestThatBeginsLikeAReplyIsARequest) {
  Bytes reply = Rtu(20, "03025800");
  reply.push_back(0x00);
  for (const std::size_t piece : kPieces) {
    EXPECT_EQ(Heard(reply, piece).frames(), Frames{reply}) << "read 0258, by " << piece;
  }
}

TEST(ModbusRtuRequestRule, TheLongestFramesAreAccepted) {
  Bytes pdu = WriteRegistersRequest(0, std::vector<std::uint16_t>(123, 0x0106));
  const Bytes known = Wrap(Framing::rtu, 20, pdu);
  pdu.assign(kMaxPdu, 0x64);
  const Bytes unknown = Wrap(Framing::rtu, 20, pdu);
  ASSERT_EQ(unknown.size(), kMaxRtu);
  for (const std::size_t piece : kPieces) {
    EXPECT_EQ(Heard(known, piece).frames(), Frames{known});
    EXPECT_EQ(Heard(unknown, piece).frames(), Frames{unknown});
  }
}

TEST(ModbusRtuRequestRule, DriverNoiseBeforeARequestIsSkipped) {
  for (const char* noise : {"00", "FF", "00 00 00", "FF 00", "00 FF FF", "FE", "F8 FF"}) {
    for (std::uint8_t slave = 1; slave <= kLastSlave; ++slave) {
      const Bytes request = Rtu(slave, "0301F40001");
      const Listener listener = Heard(Joined({Hex(noise), request}));
      ASSERT_EQ(listener.frames(), Frames{request}) << noise << " before slave " << int{slave};
    }
  }
  EXPECT_EQ(Heard(Joined({Hex("00 FF"), kRead, Hex("FF 00")})).blame(), Outcome::none);
  EXPECT_NE(Heard(Joined({Hex("FE"), kRead})).blame(), Outcome::none);
  for (const char* noise : {"FF", "00"}) {
    const Bytes request = Rtu(3, "1003E70001020005");
    Listener at_once;
    at_once.Hear(Joined({Hex(noise), request}));
    EXPECT_EQ(at_once.frames(), Frames{request});
  }
}

TEST(ModbusRtuRequestRule, ABroadcastIsAFrame) {
  const Bytes all = Rtu(0, "0600080002");
  Listener listener;
  listener.Hear(all);
  EXPECT_EQ(listener.frames(), Frames{all});
}

TEST(ModbusRtuRequestRule, OtherNoiseDiscardsTheFollowingRequest) {
  Listener listener;
  listener.Hear(Joined({Hex("13 37 01 03"), kRead}));
  EXPECT_TRUE(listener.frames().empty());
  listener.Silence();
  EXPECT_TRUE(listener.frames().empty()) << "it may lie inside something else";
  EXPECT_EQ(listener.blame(), Outcome::corrupt);
  listener.Hear(kRead);
  EXPECT_EQ(listener.frames(), Frames{kRead}) << "the master repeats it";
}

Bytes DataAround(std::size_t at, std::uint8_t filler) {
  Bytes data(120, filler);
  std::ranges::copy(kWrite, data.begin() + static_cast<std::ptrdiff_t>(at));
  return data;
}

TEST(ModbusRtuRequestRule, AWriteInsideAReplyIsNotExecuted) {
  for (const std::uint8_t filler : kFillers) {
    for (std::size_t at = 0; at + kWrite.size() <= 120; ++at) {
      const Bytes stream = Joined({ReadReply(DataAround(at, filler)), kRead});
      for (const std::size_t piece : kPieces) {
        const Listener listener = Heard(stream, piece);
        ASSERT_EQ(listener.frames(), Frames{kRead})
            << int{filler} << " at " << at << " by " << piece;
        ASSERT_EQ(listener.blame(), Outcome::none);
      }
    }
  }
}

TEST(ModbusRtuRequestRule, AWriteInsideADamagedReplyIsNotExecuted) {
  for (const std::uint8_t slave : {std::uint8_t{2}, kOther}) {
    for (const std::size_t at : {0U, 1U, 5U, 60U, 112U}) {
      for (const std::uint8_t filler : kFillers) {
        const Bytes reply = ReadReply(DataAround(at, filler), slave);
        for (std::size_t bit = 0; bit < reply.size() * 8; ++bit) {
          Bytes damaged = reply;
          damaged[bit / 8] = static_cast<std::uint8_t>(damaged[bit / 8] ^ (1U << (bit % 8)));
          for (const std::size_t piece : {std::size_t{1}, std::size_t{16}, std::size_t{1000}}) {
            Listener listener = Heard(Joined({damaged, kRead}), piece);
            ASSERT_FALSE(listener.Executed(kWrite)) << "bit " << bit << ", write at " << at;
            ASSERT_NE(listener.blame(), Outcome::none);
            listener.Hear(kRead);
            ASSERT_TRUE(listener.Executed(kRead));
          }
        }
      }
    }
  }
}

TEST(ModbusRtuRequestRule, AWriteInsideAnIncompleteReplyIsNotExecuted) {
  for (const std::uint8_t filler : kFillers) {
    const Bytes reply = ReadReply(DataAround(50, filler));
    for (std::size_t length = 1; length < reply.size(); ++length) {
      EXPECT_FALSE(Heard(View(reply).first(length)).Executed(kWrite)) << length;
      EXPECT_FALSE(Heard(Joined({Bytes(reply.begin(), reply.end() - 3), kRead})).Executed(kRead));
      if (length == 3 || filler != 0x64) continue;
      const bool begins = length == 3 + 50;
      EXPECT_EQ(Heard(View(reply).subspan(length)).Executed(kWrite), begins) << length;
    }
  }
}

TEST(ModbusRtuRequestRule, AFloodWithoutSilenceExecutesNothing) {
  std::mt19937 random(5);
  for (int round = 0; round < 200; ++round) {
    const int kind = round % 4;
    Bytes flood = {0x55, 0x55};
    while (flood.size() < 3000) {
      if (kind == 0)
        flood.resize(flood.size() + random() % 20, static_cast<std::uint8_t>(random()));
      for (std::size_t i = random() % 60; kind > 0 && i > 0; --i) {
        const std::uint8_t byte = static_cast<std::uint8_t>(random());
        flood.push_back(kind == 1 ? byte : static_cast<std::uint8_t>(byte % (kind == 2 ? 2 : 8)));
      }
      Append(flood, View(kWrite));
    }
    for (const std::size_t piece : {std::size_t{1}, std::size_t{16}, std::size_t{5000}}) {
      Listener listener = Heard(flood, piece);
      ASSERT_FALSE(listener.Executed(kWrite)) << "round " << round << " by " << piece;
      listener.Hear(kRead);
      ASSERT_TRUE(listener.Executed(kRead));
    }
  }
}

}  // namespace
}  // namespace baudgate::protocols::modbus

namespace baudgate::protocols {
namespace {

using protocols::modbus::Framing;
using protocols::modbus::Hex;
using protocols::modbus::Unwrap;
using protocols::modbus::Wrap;

Bytes Frame(Framing framing, const char* pdu) { return Wrap(framing, 20, Hex(pdu)); }

/// Returns the bytes that an ASCII frame encodes, because its digits can have either case.
Bytes Meaning(View frame) {
  const auto adu = Unwrap(Framing::ascii, frame);
  Bytes bytes = {adu ? adu->slave : std::uint8_t{0}};
  if (adu) Append(bytes, adu->pdu);
  return bytes;
}

/// Returns noise with many bytes that can begin a frame.
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
  // An RTU frame begins after silence or after another frame, so it is not found behind garbage.
  subject.found_behind_garbage = framing == Framing::ascii;
  return subject;
}

/// One request with its replies, because the request determines the length of a reply.
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

TEST(ModbusRtuReplyRule, AFrameEndsWithItsLastByte) {
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

TEST(ModbusRtuReplyRule, AReplyOfAnotherSlaveIsSkipped) {
  Cutter cutter("0301F40001");
  Bytes stream = Wrap(Framing::rtu, 21, Hex("03020099"));
  EXPECT_FALSE(cutter.Take(stream).has_value());
  EXPECT_EQ(cutter.assembler.blame(), Outcome::unexpected);
  EXPECT_TRUE(cutter.Take(Hex("14 03 02 00 31 74 53")).has_value());
}

TEST(ModbusReplyRules, AReplyOfAnotherFormIsAccepted) {
  for (const Framing framing : {Framing::rtu, Framing::ascii}) {
    for (const char* pdu : {"030400310032", "080000A55A", "04020031", "8402", "0600080002"}) {
      Cutter cutter("0301F40001", framing);
      const Bytes reply = Frame(framing, pdu);
      EXPECT_EQ(cutter.Take(reply), std::optional(reply)) << pdu;
    }
  }
}

TEST(ModbusRtuReplyRule, AnEchoOfAReadIsSkipped) {
  Cutter cutter("0301F40001");
  EXPECT_EQ(cutter.Take(Hex("14 03 01 F4 00 01 C6 C1 14 03 02 00 31 74 53")),
            std::optional(Hex("14 03 02 00 31 74 53")));
}

TEST(ModbusRtuReplyRule, DistinguishesDamageSilenceAndNoise) {
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

TEST(ModbusRtuReplyRule, AReplyOfAnUnknownFunctionEndsWithSilence) {
  Cutter cutter("640102");
  const Bytes reply = Frame(Framing::rtu, "640504030201");
  EXPECT_FALSE(cutter.Take(reply).has_value());
  EXPECT_EQ(cutter.Take({}, true), std::optional(reply));
}

TEST(ModbusAsciiReplyRule, AReplyWithoutLineFeedEndsWithSilence) {
  Cutter cutter("0301F40001", Framing::ascii);
  EXPECT_FALSE(cutter.Take(ToBytes(":1403020031B6\r")).has_value());
  EXPECT_EQ(cutter.Take({}, true), std::optional(ToBytes(":1403020031B6\r")));
}

TEST(ModbusAsciiReplyRule, AColonStartsANewFrame) {
  Cutter cutter("0301F40001", Framing::ascii);
  EXPECT_EQ(cutter.Take(ToBytes(":140302:1403020031b6\r\n")),
            std::optional(ToBytes(":1403020031b6\r\n")));
}

TEST(ModbusAsciiReplyRule, OtherSlavesAndEchoesAreSkipped) {
  Cutter cutter("0301F40001", Framing::ascii);
  EXPECT_FALSE(cutter.Take(Wrap(Framing::ascii, 21, Hex("03020031"))).has_value());
  EXPECT_FALSE(cutter.Take(Frame(Framing::ascii, "0301F40001")).has_value()) << "an echo";
  EXPECT_TRUE(cutter.Take(Frame(Framing::ascii, "03020031")).has_value());
}

TEST(ModbusAsciiReplyRule, AnOverlongFrameIsDiscarded) {
  Cutter cutter("0301F40001", Framing::ascii);
  EXPECT_FALSE(cutter.Take(ToBytes(":" + std::string(510, '0'))).has_value());
  EXPECT_EQ(cutter.assembler.held(), 511U);
  EXPECT_FALSE(cutter.Take(ToBytes("00")).has_value());
  EXPECT_EQ(cutter.assembler.held(), 0U);
}

}  // namespace
}  // namespace baudgate::protocols
