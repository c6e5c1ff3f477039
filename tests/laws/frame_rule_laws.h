// The laws of frame rules, as three parameterised test suites. A protocol instantiates them with
// its own frames and garbage. FrameRuleLaws holds for every rule; ChecksumLaws and GarbageLaws are
// only run for subjects with the flag `checksum` or `found_behind_garbage`:
//
//   using ::testing::ValuesIn;
//   INSTANTIATE_TEST_SUITE_P(Dcon, FrameRuleLaws, ValuesIn(Subjects()), LawSubjectName);
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <random>
#include <string>
#include <vector>

#include "gateway/base/text.h"
#include "protocols/assembler.h"

namespace baudgate {

struct LawSubject {
  std::string name;  ///< letters and digits only
  protocols::FrameRule rule = nullptr;
  protocols::Expectation expect;
  std::vector<Bytes> frames;
  /// Returns bytes without a whole frame: noise, truncated frames, foreign text.
  std::function<Bytes(std::mt19937&)> garbage;
  /// Returns the part of a frame that laws compare, for example without its checksum; by default
  /// the whole frame.
  std::function<Bytes(View)> essence = [](View frame) { return Bytes(frame.begin(), frame.end()); };
  /// True if the frames have a check value. Without one, damage cannot be detected.
  bool checksum = true;
  /// True if a good frame after garbage is found. False if only silence marks the begin of a frame.
  bool found_behind_garbage = true;
};

inline std::vector<LawSubject> WithChecksum(std::vector<LawSubject> subjects) {
  std::erase_if(subjects, [](const LawSubject& subject) { return !subject.checksum; });
  return subjects;
}
inline std::vector<LawSubject> FoundBehindGarbage(std::vector<LawSubject> subjects) {
  std::erase_if(subjects, [](const LawSubject& subject) { return !subject.found_behind_garbage; });
  return subjects;
}

inline std::string LawSubjectName(const ::testing::TestParamInfo<LawSubject>& info) {
  return info.param.name;
}

class FrameRuleLaws : public ::testing::TestWithParam<LawSubject> {
 protected:
  using Frames = std::vector<Bytes>;

  static Frames Deliver(const LawSubject& subject, View stream,
                        const std::vector<std::size_t>& cuts) {
    protocols::Assembler assembler;
    assembler.Begin(subject.rule, subject.expect);
    Frames frames;
    std::size_t from = 0;
    const auto take = [&](std::size_t to) {
      assembler.Feed(stream.subspan(from, to - from));
      from = to;
      while (auto frame = assembler.Next(false)) frames.push_back(std::move(*frame));
      EXPECT_LE(assembler.held(), subject.expect.max_bytes);
    };
    for (const std::size_t cut : cuts) take(cut);
    take(stream.size());
    while (auto frame = assembler.Next(true)) frames.push_back(std::move(*frame));
    const protocols::AssemblerCounters& count = assembler.counters();
    EXPECT_EQ(count.in, stream.size());
    EXPECT_EQ(count.in, count.delivered + count.discarded + assembler.held());
    EXPECT_EQ(assembler.held(), 0U) << "bytes held after the line fell silent";
    return frames;
  }

  static Frames Essences(const LawSubject& subject, const Frames& frames) {
    Frames essences;
    for (const Bytes& frame : frames) essences.push_back(subject.essence(frame));
    return essences;
  }
};

class ChecksumLaws : public FrameRuleLaws {};
class GarbageLaws : public FrameRuleLaws {};

TEST_P(FrameRuleLaws, AnyTwoCutsGiveTheSameFrame) {
  const LawSubject& subject = GetParam();
  ASSERT_FALSE(subject.frames.empty());
  for (const Bytes& frame : subject.frames) {
    ASSERT_EQ(Deliver(subject, frame, {}), Frames{frame}) << Printable(frame);
    for (std::size_t i = 0; i <= frame.size(); ++i) {
      for (std::size_t j = i; j <= frame.size(); ++j) {
        ASSERT_EQ(Deliver(subject, frame, {i, j}), Frames{frame})
            << Printable(frame) << " cut at " << i << " and " << j;
      }
    }
  }
}

TEST_P(FrameRuleLaws, ByteByByteGivesTheSameFrame) {
  const LawSubject& subject = GetParam();
  for (const Bytes& frame : subject.frames) {
    std::vector<std::size_t> cuts(frame.size());
    for (std::size_t i = 0; i < cuts.size(); ++i) cuts[i] = i;
    ASSERT_EQ(Deliver(subject, frame, cuts), Frames{frame}) << Printable(frame);
  }
}

TEST_P(GarbageLaws, GarbageInFrontDoesNotHideAGoodFrame) {
  const LawSubject& subject = GetParam();
  std::mt19937 random(20261121);
  for (int round = 0; round < 500; ++round) {
    const Bytes& frame = subject.frames[random() % subject.frames.size()];
    Bytes stream = subject.garbage(random);
    const std::size_t noise = stream.size();
    Append(stream, frame);
    std::vector<std::size_t> cuts;
    for (std::size_t at = random() % 7; at < stream.size(); at += 1 + random() % 9)
      cuts.push_back(at);
    const Frames frames = Essences(subject, Deliver(subject, stream, cuts));
    ASSERT_FALSE(frames.empty()) << "lost behind " << Printable(View(stream).first(noise));
    ASSERT_EQ(frames.back(), subject.essence(frame))
        << "behind " << Printable(View(stream).first(noise));
    ASSERT_EQ(frames, Essences(subject, Deliver(subject, stream, {})))
        << "depends on fragmentation";
  }
}

TEST_P(ChecksumLaws, NoFlippedBitPassesAsAGoodFrame) {
  const LawSubject& subject = GetParam();
  for (const Bytes& frame : subject.frames) {
    const Bytes truth = subject.essence(frame);
    for (std::size_t bit = 0; bit < frame.size() * 8; ++bit) {
      Bytes damaged = frame;
      damaged[bit / 8] = static_cast<std::uint8_t>(damaged[bit / 8] ^ (1U << (bit % 8)));
      for (const Bytes& got : Essences(subject, Deliver(subject, damaged, {}))) {
        ASSERT_EQ(got, truth) << "bit " << bit << " flipped: " << Printable(damaged);
      }
    }
  }
}

TEST_P(ChecksumLaws, TruncatedFramesDeliverNoWrongContent) {
  const LawSubject& subject = GetParam();
  for (const Bytes& frame : subject.frames) {
    const Bytes truth = subject.essence(frame);
    for (std::size_t length = 1; length < frame.size(); ++length) {
      for (const Bytes& got : Essences(subject, Deliver(subject, View(frame).first(length), {}))) {
        ASSERT_EQ(got, truth) << "cut to " << length << " of " << Printable(frame);
      }
    }
  }
}

TEST_P(FrameRuleLaws, RandomBytesMakeProgressInBoundedMemory) {
  const LawSubject& subject = GetParam();
  std::mt19937 random(7);
  for (int round = 0; round < 50; ++round) {
    Bytes stream(1 + random() % 2000);
    for (std::uint8_t& byte : stream) byte = static_cast<std::uint8_t>(random());
    std::vector<std::size_t> cuts;
    for (std::size_t at = random() % 50; at < stream.size(); at += 1 + random() % 200)
      cuts.push_back(at);
    Deliver(subject, stream, cuts);
  }
}

TEST_P(FrameRuleLaws, TheSameBytesGetTheSameCut) {
  const LawSubject& subject = GetParam();
  std::mt19937 random(99);
  for (int round = 0; round < 200; ++round) {
    Bytes slice = subject.garbage(random);
    Append(slice, subject.frames[random() % subject.frames.size()]);
    slice.resize(1 + random() % slice.size());
    for (const bool idle : {false, true}) {
      const protocols::Cut first = subject.rule(slice, subject.expect, idle);
      const protocols::Cut second = subject.rule(slice, subject.expect, idle);
      ASSERT_EQ(first.kind, second.kind);
      ASSERT_EQ(first.size, second.size);
      ASSERT_LE(first.size, slice.size());
      if (first.kind != protocols::Cut::Kind::need_more) {
        ASSERT_GE(first.size, 1U);
      }
    }
  }
}

}  // namespace baudgate
