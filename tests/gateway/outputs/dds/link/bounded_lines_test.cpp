// What another process may write into our log.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/outputs/dds/link/child_process.h"
#include "tests/support/times.h"

namespace baudgate::dds {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

TEST(BoundedLines, WholeLinesOnlyAndPrintable) {
  BoundedLines lines;
  EXPECT_THAT(lines.Add("ab", kStart), IsEmpty());
  EXPECT_THAT(lines.Add("c\n\nd\x1b[2J\nrest", kStart), ElementsAre("abc", "d?[2J"));
}

TEST(BoundedLines, ALongLineIsCut) {
  BoundedLines lines;
  EXPECT_THAT(lines.Add(std::string(100'000, 'x') + "\n", kStart),
              ElementsAre(std::string(BoundedLines::kLongest, 'x')));
}

TEST(BoundedLines, AFloodIsCounted) {
  BoundedLines lines;
  std::string flood;
  for (int i = 0; i < 1000; ++i) flood += "line\n";
  EXPECT_THAT(lines.Add(flood, kStart), SizeIs(BoundedLines::kMost));
  EXPECT_THAT(lines.Add("next\n", kStart + BoundedLines::kPeriod),
              ElementsAre("980 lines were left out", "next"));
}

}  // namespace
}  // namespace baudgate::dds
