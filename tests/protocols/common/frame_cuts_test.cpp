// The cuts that frame rules share.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/common/frame_cuts.h"

#include <gtest/gtest.h>

namespace baudgate {
namespace {

TEST(FrameCuts, NoiseIsDroppedInRunsOfOneKind) {
  struct Case {
    const char* what;
    std::string_view held;
    std::size_t size;
    Outcome blame;
  };
  using namespace std::string_view_literals;
  for (const Case& c : {Case{"up to a start", "abc>1"sv, 3, Outcome::partial},
                        Case{"all there is", "abc"sv, 3, Outcome::partial},
                        Case{"harmless bytes first", "\0\xFF\0ab>"sv, 3, Outcome::none},
                        Case{"up to harmless bytes", "ab\0\0>"sv, 2, Outcome::partial},
                        Case{"what the protocol calls harmless", "\n\n>"sv, 2, Outcome::none}}) {
    const Cut got = cut::SkipNoise(ToBytes(c.held), "<>", "\n");
    EXPECT_EQ(got.kind, Cut::Kind::discard) << c.what;
    EXPECT_EQ(got.size, c.size) << c.what;
    EXPECT_EQ(got.blame, c.blame) << c.what;
  }
}

TEST(FrameCuts, OneByteIsBlamedUnlessADriverGaveIt) {
  EXPECT_EQ(cut::Slide(Bytes{0x00, 1}, "").blame, Outcome::none);
  EXPECT_EQ(cut::Slide(Bytes{0xFF, 1}, "").blame, Outcome::none);
  EXPECT_EQ(cut::Slide(Bytes{0x0A, 1}, "").blame, Outcome::partial);
  EXPECT_EQ(cut::Slide(Bytes{0x0A, 1}, "").size, 1U);
}

TEST(FrameCuts, AnIncompleteFrameWaitsUntilTheLineIsSilent) {
  EXPECT_EQ(cut::Wait(false).kind, Cut::Kind::need_more);
  const Cut over = cut::Wait(true, 7);
  EXPECT_EQ(over.kind, Cut::Kind::discard);
  EXPECT_EQ(over.size, 7U);
  EXPECT_EQ(over.blame, Outcome::partial);
}

}  // namespace
}  // namespace baudgate
