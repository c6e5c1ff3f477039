// Frames on a terminal.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <unistd.h>

#include <sstream>

#include "gateway/tools/terminal/live_table.h"

namespace baudgate {
namespace {

TEST(LiveScreen, IsLeftAsItWas) {
  std::ostringstream out;
  {
    const LiveScreen screen(out);
    EXPECT_EQ(out.str(), "\x1b[?1049h\x1b[?25l\x1b[2J");
    out.str({});
  }
  EXPECT_EQ(out.str(), "\x1b[?25h\x1b[?1049l");
}

TEST(LiveScreen, OverwritesWithoutClearingFirst) {
  std::ostringstream out;
  LiveScreen screen(out);
  out.str({});
  screen.Draw("a\nb\n", 0);
  EXPECT_EQ(out.str(), "\x1b[Ha\x1b[K\nb\x1b[K\x1b[J");
  out.str({});
  screen.Draw("a\nb\n", 0);
  EXPECT_EQ(out.str(), "") << "nothing is another";
  screen.Draw("a\n\nc\nd", 3);
  EXPECT_EQ(out.str(), "\x1b[Ha\x1b[K\n\x1b[K\n\u2026 2 more\x1b[K\x1b[J")
      << "what does not fit would scroll";
}

TEST(LiveScreen, NeedsATerminal) {
  int ends[2] = {};
  ASSERT_EQ(::pipe(ends), 0);
  EXPECT_EQ(LiveScreen::Possible(ends[1]).error(), "standard output is no terminal");
  ::close(ends[0]);
  ::close(ends[1]);
}

}  // namespace
}  // namespace baudgate
