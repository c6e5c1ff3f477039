// Sentences in a terminal.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/tools/terminal/tables.h"

namespace baudgate {
namespace {

using ::testing::ElementsAre;

TEST(Wrap, BreaksAtWords) {
  EXPECT_THAT(WrapLines("check power, address and wiring", 14),
              ElementsAre("check power,", "address and", "wiring"));
  EXPECT_THAT(WrapLines("exactly 10", 10), ElementsAre("exactly 10"));
  EXPECT_THAT(WrapLines("/dev/serial/by-id/usb x", 10),
              ElementsAre("/dev/seria", "l/by-id/us", "b x"));
  EXPECT_THAT(WrapLines("\u00B0\u00B0\u00B0\u00B0 \u00B0", 4),
              ElementsAre("\u00B0\u00B0\u00B0\u00B0", "\u00B0"));
  EXPECT_THAT(WrapLines("as long as it likes", 0), ElementsAre("as long as it likes"));
  EXPECT_THAT(WrapLines("", 5), ElementsAre(""));
}

TEST(Wrap, IndentsFurtherLines) {
  EXPECT_EQ(WrapSentence("bay-1.feeder-2: has never answered; check power", 28),
            "bay-1.feeder-2: has never\n  answered; check power\n");
  EXPECT_EQ(WrapSentence("one", 28), "one\n");
  EXPECT_EQ(WrapSentence("no terminal, no limit", 0), "no terminal, no limit\n");
}

}  // namespace
}  // namespace baudgate
