// Rows of tables that fit a terminal.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <sstream>

#include "gateway/tools/terminal/tables.h"

namespace baudgate {
namespace {

TEST(ColumnLayout, StandsSideBySideWhereItFits) {
  const ColumnLayout layout({{5}, {6, true}, {0}, {4}}, 20);
  EXPECT_EQ(layout.Row({"a", "12.5", "", "good"}), "a        12.5  good\n");
  EXPECT_EQ(layout.Row({"\u00B0C", "1", "", ""}), "\u00B0C          1\n");
}

TEST(ColumnLayout, FoldsLaterColumnsAndWrapsTheLast) {
  const ColumnLayout layout({{10}, {10}, {2}, {60}}, 30);
  EXPECT_EQ(layout.Row({"2026-11-27", "user:anna", "ok", "a reason that goes on and on here"}),
            "2026-11-27  user:anna   ok\n"
            "    a reason that goes on and\n"
            "    on here\n");
  EXPECT_EQ(layout.Row({"2026-11-27", "user:anna", "ok", ""}), "2026-11-27  user:anna   ok\n");
}

TEST(ColumnLayout, WithoutALimitNothingIsFolded) {
  const ColumnLayout layout({{3}, {60}}, 0);
  EXPECT_EQ(layout.Row({"a", "a reason that goes on and on, for longer than any terminal is wide"}),
            "a    a reason that goes on and on, for longer than any terminal is wide\n");
}

TEST(ColumnLayout, IsThatOfBothKindsOfTables) {
  std::ostringstream out;
  StreamTable stream({{"point", 36}, {"count", 8, true}, {"reason"}}, 30);
  stream.Print({{"bay-1.a", "12", "one two three four five six"}}, out);
  config::TextTable table({"point", "none", "text"});
  table.Add({"a", "", "one two three four five six seven"});
  table.PrintAligned(out, "  ", 24);
  EXPECT_EQ(out.str(),
            "point    count\n"
            "    reason\n"
            "bay-1.a     12\n"
            "    one two three four five\n"
            "    six\n"
            "  point\n"
            "      text\n"
            "  a\n"
            "      one two three four\n"
            "      five six seven\n");
}

}  // namespace
}  // namespace baudgate
