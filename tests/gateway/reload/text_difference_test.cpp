// SPDX-License-Identifier: Apache-2.0
#include "gateway/reload/text_difference.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace baudgate::reload {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(TextDifference, NamesLines) {
  EXPECT_THAT(TextDifference("a\nb\nc\n", "a\nb\nc\n"), IsEmpty());
  EXPECT_THAT(TextDifference("a\nb\nc\n", "a\nx\nc\n"), ElementsAre("  a", "- b", "+ x", "  c"));
  EXPECT_THAT(TextDifference("a\nb\n", "a\n"), ElementsAre("  a", "- b"));
  EXPECT_THAT(TextDifference("", "a\n"), ElementsAre("+ a"));
  EXPECT_THAT(TextDifference("a", ""), ElementsAre("- a"));
  EXPECT_THAT(TextDifference("a\na\na\n", "a\na\n"), ElementsAre("  a", "  a", "- a"));
}

TEST(TextDifference, LeavesOutWhatIsFarAway) {
  EXPECT_THAT(TextDifference("1\n2\n3\n4\n5\n6\n7\n", "1\n2\n3\n4\nx\n6\n7\n", 1),
              ElementsAre("…", "  4", "- 5", "+ x", "  6", "…"));
}

}  // namespace
}  // namespace baudgate::reload
