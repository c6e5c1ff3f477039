// Tests how the bytes of clients are cut into RTU and MBAP frames, how a wrong framing is
// recognised, and how requests are checked.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "gateway/base/text.h"
#include "gateway/outputs/modbus/wire/request.h"
#include "protocols/modbus/protocol.h"
#include "tests/gateway/outputs/modbus/registers/points.h"

namespace baudgate::modbus {
namespace {

using FramingState = ClientFraming::State;

class RtuFramingTest : public testing::Test {
 protected:
  static Bytes Rtu(std::uint8_t slave, const std::string& pdu) {
    return protocols::ModbusRtuProtocol().carrier->wrap(slave, ParseHex(pdu).value());
  }
  void Put(View bytes) {
    while (!bytes.empty()) {
      const auto space = framing_.Space();
      ASSERT_FALSE(space.empty());
      const std::size_t count = std::min(space.size(), bytes.size());
      std::copy_n(bytes.begin(), count, space.begin());
      framing_.Commit(count);
      bytes = bytes.subspan(count);
    }
  }
  std::string Take() {
    View frame;
    const FramingState peeked = framing_.Peek();
    EXPECT_EQ(framing_.Take(frame), peeked);
    return peeked == FramingState::frame ? ToHex(frame) : "need more";
  }

  SerialFraming framing_{protocols::ModbusRtuProtocol()};
};

TEST_F(RtuFramingTest, EveryCutOfEveryFunctionGivesTheModbusTcpForm) {
  for (const char* pdu : {"03 01 F4 00 01", "06 00 08 00 02", "10 00 01 00 02 04 00 0A 01 02",
                          "0F 00 13 00 0A 02 CD 01", "16 00 04 00 F2 00 25", "2B 0E 01 00",
                          "17 00 03 00 06 00 0E 00 01 02 00 FF", "08 00 00 A5 37"}) {
    const Bytes frame = Rtu(20, pdu);
    const std::string expected = ToHex(AduOf(0, 20, ParseHex(pdu).value()));
    for (std::size_t cut = 0; cut < frame.size(); ++cut) {
      Put(View(frame).first(cut));
      ASSERT_EQ(Take(), "need more") << pdu << " cut at " << cut;
      Put(View(frame).subspan(cut));
      ASSERT_EQ(Take(), expected) << pdu << " cut at " << cut;
      ASSERT_EQ(Take(), "need more");
    }
  }
}

TEST_F(RtuFramingTest, FramesInOnePieceAreTakenInOrder) {
  Bytes both = Rtu(20, "03 01 F4 00 01");
  Append(both, View(Rtu(21, "06 00 08 00 02")));
  Put(both);
  View first;
  ASSERT_EQ(framing_.Take(first), FramingState::frame);
  ASSERT_EQ(framing_.Peek(), FramingState::frame);
  EXPECT_EQ(ToHex(first), "00 00 00 00 00 06 14 03 01 F4 00 01") << "valid after Peek";
  EXPECT_EQ(Take(), "00 00 00 00 00 06 15 06 00 08 00 02");
}

TEST_F(RtuFramingTest, ADamagedFrameIsDroppedAndTheNextFrameIsFound) {
  const Bytes good = Rtu(20, "03 01 F4 00 01");
  for (std::size_t at = 0; at < good.size(); ++at) {
    Bytes damaged = good;
    damaged[at] ^= 0x10;
    Put(damaged);
    Take();
    framing_.Settle();
    ASSERT_EQ(Take(), "need more") << "damaged at " << at;
    Put(good);
    ASSERT_EQ(Take(), "00 00 00 00 00 06 14 03 01 F4 00 01") << "damaged at " << at;
  }
}

TEST_F(RtuFramingTest, SilenceDropsHalfAFrame) {
  const Bytes block = Rtu(20, "10 00 01 00 02 04 00 0A 01 02");
  Put(View(block).first(7));
  EXPECT_EQ(Take(), "need more");
  framing_.Settle();
  EXPECT_EQ(Take(), "need more");
  Put(Rtu(20, "03 01 F4 00 01"));
  EXPECT_EQ(Take(), "00 00 00 00 00 06 14 03 01 F4 00 01");
}

TEST_F(RtuFramingTest, SilenceEndsAFrameOfUnknownLength) {
  Put(Rtu(20, "64 DE AD BE EF 01"));
  EXPECT_EQ(Take(), "need more");
  framing_.Settle();
  EXPECT_EQ(Take(), "00 00 00 00 00 07 14 64 DE AD BE EF 01");
}

TEST_F(RtuFramingTest, MemoryIsBoundedWhileFramesAreNotTaken) {
  const Bytes frame = Rtu(20, "03 01 F4 00 01");
  std::size_t put = 0;
  while (!framing_.Space().empty()) {
    const auto space = framing_.Space();
    const std::size_t count = std::min(space.size(), frame.size());
    std::copy_n(frame.begin(), count, space.begin());
    framing_.Commit(count);
    ++put;
  }
  EXPECT_EQ(put, 128U);
  for (std::size_t i = 0; i < put; ++i) {
    ASSERT_EQ(Take(), "00 00 00 00 00 06 14 03 01 F4 00 01");
  }
  EXPECT_EQ(Take(), "need more");
  EXPECT_FALSE(framing_.Space().empty());
}

TEST_F(RtuFramingTest, RepliesHaveAddressAndCrc) {
  Bytes out = {0xAA};
  framing_.Append(out, AduOf(0x1234, 20, ParseHex("03 02 09 C4").value()));
  EXPECT_EQ(ToHex(out), "AA 14 03 02 09 C4 B2 44");
  EXPECT_TRUE(framing_.one_at_a_time());
}

using MbapState = MbapAssembler::State;

void Feed(MbapAssembler& assembler, View bytes) {
  const auto space = assembler.Space();
  ASSERT_GE(space.size(), bytes.size());
  std::ranges::copy(bytes, space.begin());
  assembler.Commit(bytes.size());
}

std::vector<Bytes> TakeAll(MbapAssembler& assembler) {
  std::vector<Bytes> frames;
  View frame;
  while (assembler.Take(frame) == MbapState::frame) frames.emplace_back(frame.begin(), frame.end());
  return frames;
}

TEST(Mbap, EveryCutGivesTheSameFrames) {
  const std::vector<Bytes> frames = {Frame(1, "03 00 00 00 02"), Frame(7, "07"),
                                     Frame(1, "10 00 00 00 01 02 12 34")};
  Bytes stream;
  for (const Bytes& frame : frames) Append(stream, frame);
  for (std::size_t cut = 0; cut <= stream.size(); ++cut) {
    MbapAssembler assembler;
    Feed(assembler, View(stream).first(cut));
    std::vector<Bytes> seen = TakeAll(assembler);
    Feed(assembler, View(stream).subspan(cut));
    for (Bytes& frame : TakeAll(assembler)) seen.push_back(std::move(frame));
    EXPECT_EQ(seen, frames) << "cut at " << cut;
  }
}

TEST(Mbap, AFrameInSingleBytesIsTaken) {
  const Bytes frame = Frame(1, "03 00 00 00 02");
  MbapAssembler assembler;
  for (std::size_t i = 0; i + 1 < frame.size(); ++i) {
    Feed(assembler, View(frame).subspan(i, 1));
    EXPECT_EQ(assembler.Peek(), MbapState::need_more);
  }
  Feed(assembler, View(frame).last(1));
  EXPECT_EQ(TakeAll(assembler), std::vector<Bytes>{frame});
}

TEST(Mbap, TheLongestFrameMayArriveInTwoParts) {
  const Bytes longest = Frame(1, std::string(2 * 253, '0'));
  ASSERT_EQ(longest.size(), kMaxAdu);
  MbapAssembler assembler;
  for (int i = 0; i < 100; ++i) {
    Feed(assembler, View(longest).first(200));
    EXPECT_EQ(assembler.Peek(), MbapState::need_more);
    Feed(assembler, View(longest).subspan(200));
    EXPECT_EQ(TakeAll(assembler).size(), 1U);
  }
}

TEST(Mbap, AFloodOfFramesIsBoundedAndLosesNothing) {
  const Bytes frame = Frame(1, "03 00 00 00 02");
  MbapAssembler assembler;
  std::size_t offered = 0;
  std::size_t frames = 0;
  while (offered < 100 * frame.size()) {
    const auto space = assembler.Space();
    ASSERT_FALSE(space.empty());
    ASSERT_LE(space.size(), 8 * kMaxAdu);
    for (auto& byte : space) byte = frame[offered++ % frame.size()];
    assembler.Commit(space.size());
    frames += TakeAll(assembler).size();
  }
  EXPECT_EQ(frames, offered / frame.size());
}

struct DefectCase {
  const char* name;
  const char* hex;
  const char* defect;
};

class MbapDefects : public testing::TestWithParam<DefectCase> {};

TEST_P(MbapDefects, AreDetectedAsSoonAsPossible) {
  MbapAssembler assembler;
  Feed(assembler, ParseHex(GetParam().hex).value());
  EXPECT_EQ(assembler.Peek(), MbapState::malformed);
  View frame;
  EXPECT_EQ(assembler.Take(frame), MbapState::malformed);
  EXPECT_EQ(assembler.Defect(), GetParam().defect);
}

INSTANTIATE_TEST_SUITE_P(
    All, MbapDefects,
    testing::Values(
        DefectCase{"protocol", "00 01 12 34", "protocol id is not 0"},
        DefectCase{"length_0", "00 01 00 00 00 00", "length is too small for a function code"},
        DefectCase{"length_1", "00 01 00 00 00 01", "length is too small for a function code"},
        DefectCase{"length_255", "00 01 00 00 00 FF", "length is above 254"},
        DefectCase{"length_65535", "00 01 00 00 FF FF", "length is above 254"}),
    [](const auto& info) { return info.param.name; });

TEST(Mbap, GoodFramesBeforeADefectAreDelivered) {
  MbapAssembler assembler;
  const Bytes frame = Frame(1, "03 00 00 00 02");
  Bytes stream = frame;
  Append(stream, View(ParseHex("00 01 12 34").value()));
  Feed(assembler, stream);
  View taken;
  EXPECT_EQ(assembler.Take(taken), MbapState::frame);
  EXPECT_EQ(assembler.Take(taken), MbapState::malformed);
}

const Frames& Both() {
  static const Frames kFrames{&protocols::ModbusRtuProtocol(), &protocols::ModbusAsciiProtocol()};
  return kFrames;
}

Bytes RequestIn(Framing framing) {
  const Bytes pdu = {3, 0, 0, 0, 1};
  if (framing == Framing::tcp) return AduOf(1, 1, pdu);
  return Both().Of(framing)->carrier->wrap(1, pdu);
}

TEST(OtherFraming, RecognisesEachFraming) {
  constexpr Framing kAll[] = {Framing::tcp, Framing::rtu, Framing::ascii};
  for (const Framing expected : kAll) {
    for (const Framing spoken : kAll) {
      const auto other = OtherFraming(RequestIn(spoken), expected, Both());
      EXPECT_EQ(other, spoken == expected ? std::nullopt : std::optional(spoken))
          << Title(spoken) << " where " << Title(expected) << " is expected";
    }
  }
}

TEST(OtherFraming, WaitsForAWholeRequest) {
  for (const Framing spoken : {Framing::rtu, Framing::ascii}) {
    const Bytes request = RequestIn(spoken);
    const std::size_t whole = request.size() - (spoken == Framing::ascii ? 1 : 0);
    for (std::size_t count = 0; count < whole; ++count) {
      EXPECT_FALSE(OtherFraming(View(request).first(count), Framing::tcp, Both()))
          << Title(spoken) << ", " << count << " bytes";
    }
  }
  const Bytes request = RequestIn(Framing::tcp);
  for (std::size_t count = 0; count < request.size(); ++count) {
    EXPECT_FALSE(OtherFraming(View(request).first(count), Framing::rtu, Both())) << count;
  }
}

TEST(OtherFraming, IgnoresNoise) {
  Bytes noise(kMostLookedAt);
  std::uint32_t random = 1;
  for (std::uint8_t& byte : noise) {
    random = random * 1'664'525U + 1'013'904'223U;
    byte = static_cast<std::uint8_t>(random >> 24U);
  }
  EXPECT_FALSE(OtherFraming(noise, Framing::tcp, {}));
  EXPECT_FALSE(OtherFraming(ToBytes("GET / HTTP/1.1\r\n\r\n"), Framing::tcp, Both()));
}

/// The register count of an RTU request is at the position of the length in Modbus TCP.
TEST(OtherFraming, ADamagedRequestIsNotAnotherFraming) {
  for (std::uint8_t count = 1; count < 125; ++count) {
    Bytes request = Both().rtu->carrier->wrap(1, Bytes{3, 0, 0, 0, count});
    request.back() ^= 1;
    EXPECT_FALSE(OtherFraming(request, Framing::rtu, Both())) << int{count};
  }
}

TEST(OtherFraming, AdvisesHowToFixTheFraming) {
  EXPECT_EQ(
      ExplainOther(Framing::ascii, Framing::tcp),
      "it sends Modbus ASCII, but this listener expects Modbus TCP; set framing: ascii at the "
      "listener, or change the master");
}

struct BadRequest {
  const char* name;
  std::string pdu;
  ExceptionCode exception;
};

class BadRequests : public testing::TestWithParam<BadRequest> {};

TEST_P(BadRequests, AreRefused) {
  const Bytes frame = Frame(1, GetParam().pdu);
  ModbusRequest request;
  EXPECT_EQ(ParseRequest(frame, request), GetParam().exception);
}

std::string Zeros(std::size_t bytes) { return std::string(2 * bytes, '0'); }

constexpr auto kFunction = kIllegalFunction;

INSTANTIATE_TEST_SUITE_P(
    All, BadRequests,
    testing::Values(BadRequest{"function_0", "00", kFunction},
                    BadRequest{"function_7", "07", kFunction},
                    BadRequest{"function_22", "16 00 00 FF FF 00 00", kFunction},
                    BadRequest{"function_23", "17 00 00 00 01 00 00 00 01 02 00 00", kFunction},
                    BadRequest{"function_131", "83 00 00 00 01", kFunction},
                    BadRequest{"read_function_only", "03", kIllegalValue},
                    BadRequest{"read_short", "03 00 00 00", kIllegalValue},
                    BadRequest{"read_long", "03 00 00 00 01 00", kIllegalValue},
                    BadRequest{"read_no_registers", "04 00 00 00 00", kIllegalValue},
                    BadRequest{"read_126_registers", "03 00 00 00 7E", kIllegalValue},
                    BadRequest{"read_no_bits", "01 00 00 00 00", kIllegalValue},
                    BadRequest{"read_2001_bits", "02 00 00 07 D1", kIllegalValue},
                    BadRequest{"read_past_the_end", "03 FF FF 00 02", kIllegalAddress},
                    BadRequest{"coil_neither_on_nor_off", "05 00 00 12 34", kIllegalValue},
                    BadRequest{"coil_short", "05 00 00 FF", kIllegalValue},
                    BadRequest{"register_short", "06 00 00 00", kIllegalValue},
                    BadRequest{"register_long", "06 00 00 00 00 00", kIllegalValue},
                    BadRequest{"registers_without_data", "10 00 00 00 02 04", kIllegalValue},
                    BadRequest{"registers_header_only", "10 00 00 00 02", kIllegalValue},
                    BadRequest{"registers_byte_count", "10 00 00 00 02 02 00 00", kIllegalValue},
                    BadRequest{"registers_surplus", "10 00 00 00 01 02 00 00 00", kIllegalValue},
                    BadRequest{"registers_none", "10 00 00 00 00 00", kIllegalValue},
                    BadRequest{"registers_124", "10 00 00 00 7C F8" + Zeros(246), kIllegalValue},
                    BadRequest{"bits_byte_count", "0F 00 00 00 09 01 00", kIllegalValue},
                    BadRequest{"bits_none", "0F 00 00 00 00 00", kIllegalValue},
                    BadRequest{"bits_1969", "0F 00 00 07 B1 F7" + Zeros(247), kIllegalValue}),
    [](const auto& info) { return info.param.name; });

TEST(Request, TheLargestRequestOfEachKindIsAccepted) {
  for (const std::string& pdu :
       {std::string("03 00 00 00 7D"), std::string("04 FF 83 00 7D"), std::string("01 00 00 07 D0"),
        "10 00 00 00 7B F6" + Zeros(246), "0F 00 00 07 B0 F6" + Zeros(246)}) {
    ModbusRequest request;
    const Bytes frame = Frame(1, pdu);
    EXPECT_EQ(ParseRequest(frame, request), kNoException) << pdu.substr(0, 14);
  }
}

TEST(Request, FieldsAreParsed) {
  ModbusRequest request;
  const Bytes frame = Frame(21, "10 01 02 00 02 04 AA BB CC DD");
  ASSERT_EQ(ParseRequest(frame, request), kNoException);
  EXPECT_EQ(request.unit, 21);
  EXPECT_EQ(request.function, kWriteRegisters);
  EXPECT_EQ(request.start, 0x0102);
  EXPECT_EQ(request.count, 2);
  EXPECT_EQ(ToHex(request.data), "AA BB CC DD");
  EXPECT_EQ(request.table(), config::Table::registers);
}

TEST(Request, ComputesTheSizesOfReplies) {
  const std::pair<const char*, std::size_t> sizes[] = {
      {"01 00 00 00 01", 10},          {"02 00 00 00 08", 10}, {"02 00 00 00 09", 11},
      {"01 00 00 07 D0", 259},         {"03 00 00 00 01", 11}, {"04 00 00 00 7D", 259},
      {"05 00 00 FF 00", 12},          {"06 00 00 00 01", 12}, {"0F 00 00 00 09 02 00 01", 12},
      {"10 00 00 00 01 02 00 01", 12},
  };
  for (const auto& [pdu, size] : sizes) {
    const Bytes frame = Frame(1, pdu);
    ModbusRequest request;
    ASSERT_EQ(ParseRequest(frame, request), kNoException) << pdu;
    EXPECT_EQ(ReplySize(request), size) << pdu;
  }
}

TEST(Request, ExceptionReplyKeepsTransactionAndUnit) {
  const auto reply = ExceptionReply(Frame(9, "03 00 00 00 01", 0xABCD), kBusy);
  EXPECT_EQ(ToHex(reply), "AB CD 00 00 00 03 09 83 06");
}

}  // namespace
}  // namespace baudgate::modbus
