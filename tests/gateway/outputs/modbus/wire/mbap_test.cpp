// Framing of a client's bytes: every cut, a dribble, pipelining, floods and defects.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>

#include "gateway/outputs/modbus/wire/request.h"
#include "tests/gateway/outputs/modbus/registers/points.h"

namespace baudgate::modbus {
namespace {

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

TEST(Mbap, OneByteAtATime) {
  const Bytes frame = Frame(1, "03 00 00 00 02");
  MbapAssembler assembler;
  for (std::size_t i = 0; i + 1 < frame.size(); ++i) {
    Feed(assembler, View(frame).subspan(i, 1));
    EXPECT_EQ(assembler.Peek(), MbapState::need_more);
  }
  Feed(assembler, View(frame).last(1));
  EXPECT_EQ(TakeAll(assembler), std::vector<Bytes>{frame});
}

TEST(Mbap, LongestFrameFitsBehindAHalfOne) {
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

TEST(Mbap, AFloodIsBoundedAndLosesNothing) {
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

TEST_P(MbapDefects, IsMalformedAsSoonAsItCanBeSeen) {
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

}  // namespace
}  // namespace baudgate::modbus
