// Tests of tables of live values as text, without control characters in cells.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/terminal/live_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <limits>
#include <sstream>

#include "gateway/base/shown.h"
#include "gateway/tools/terminal/tables.h"

namespace baudgate::tools {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

PointRow ARow(std::string device, std::string point, std::string value) {
  return {.device = std::move(device),
          .point = std::move(point),
          .value = std::move(value),
          .unit = "A",
          .quality = Quality::good,
          .age = 300ms};
}

TEST(LiveTable, AlignsColumns) {
  const std::string text =
      RenderPoints({ARow("feeder-1", "current_l1", "0.5"), ARow("feeder-1", "i2", "112.25")}, {});
  EXPECT_EQ(text,
            "device    point        value  unit  quality    age\n"
            "feeder-1  current_l1     0.5  A     good     0.3 s\n"
            "          i2          112.25  A     good     0.3 s\n");
}

TEST(LiveTable, CountsCharactersNotBytes) {
  const std::vector<TableColumn> columns = {{.title = "a"}, {.title = "b"}};
  EXPECT_EQ(RenderTable(columns, {{{"\u00B0C", "x"}}, {{"mm", "y"}}}, {}),
            "a   b\n\u00B0C  x\nmm  y\n");
}

TEST(LiveTable, MarksTruncatedTextsWithAnEllipsis) {
  const std::vector<TableColumn> columns = {{.title = "a", .widest = 4}};
  EXPECT_EQ(RenderTable(columns, {{{"12345"}}, {{"1234"}}}, {.width = 80}), "a\n123\u2026\n1234\n");
  EXPECT_EQ(RenderTable(columns, {{{"12345"}}}, {}), "a\n12345\n") << "not in a file or a pipe";
  EXPECT_EQ(RenderTable({{.title = "title"}}, {{{"12345"}}}, {.width = 3}), "ti\u2026\n12\u2026\n");
}

TEST(LiveTable, CutsTextsBeforeNumbers) {
  const std::vector<TableColumn> columns = {
      {.title = "device"}, {.title = "state"}, {.title = "age", .right = true}};
  EXPECT_EQ(RenderTable(columns, {{{"bay-1.feeder-1.north", "online", "12.5 s"}}}, {.width = 30}),
            "device          state      age\n"
            "bay-1.feeder-…  online  12.5 s\n");
}

TEST(LiveTable, LeavesSpareColumnsOutFirst) {
  const std::vector<TableColumn> columns = {{.title = "device"},
                                            {.title = "retries", .right = true, .spare = true},
                                            {.title = "ok", .right = true}};
  EXPECT_EQ(RenderTable(columns, {{{"bay-1.feeder-1", "0", "99 %"}}}, {.width = 20}),
            "device            ok\nbay-1.feeder-1  99 %\n");
}

TEST(LiveTable, ShowsTheNumberOfOmittedRows) {
  const std::vector<TableRow> rows(10, TableRow{{"x"}});
  EXPECT_EQ(RenderTable({{.title = "a"}}, rows, {.height = 4}), "a\nx\nx\n\u2026 8 more\n");
  EXPECT_EQ(RenderTable({{.title = "a"}}, {{{"x"}}, {{"y"}}}, {.height = 3}), "a\nx\ny\n");
  EXPECT_EQ(RenderTable({{.title = "a"}, {.title = "b"}},
                        {{{"x", "1"}}, {{"y", "2"}}, {{"long", "3"}}}, {.height = 3}),
            "a  b\nx  1\n… 2 more\n")
      << "what is left out widens nothing";
}

TEST(LiveTable, ColoursOnlyWhereWanted) {
  PointRow bad = ARow("d", "p", "1");
  bad.quality = Quality::bad_communication;
  EXPECT_THAT(RenderPoints({bad}, {}), Not(HasSubstr("\x1b")));
  EXPECT_THAT(RenderPoints({bad}, {.colour = true}), HasSubstr("\x1b[31md"));
}

TEST(LiveTable, ShowsMissingAgeAndRemovedPoints) {
  PointRow row = ARow("d", "p", "-");
  row.age.reset();
  row.gone = true;
  const std::string text = RenderPoints({row}, {});
  EXPECT_THAT(text, HasSubstr("gone"));
  EXPECT_THAT(text, Not(HasSubstr("good")));
  EXPECT_TRUE(text.ends_with("-\n"));
}

TEST(LiveTable, RemovesControlCharacters) {
  const std::string text = RenderPoints({ARow("d\x1b[2J", "p\n", "\u009B5m\r")}, {});
  EXPECT_THAT(text, Not(HasSubstr("\x1b")));
  EXPECT_THAT(text, Not(HasSubstr("\r")));
  EXPECT_THAT(text, Not(HasSubstr("\u009B")));
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 2);
}

TEST(LiveTable, FormatsValues) {
  EXPECT_EQ(FormatValue(static_cast<double>(0.3F)), "0.3");
  EXPECT_EQ(FormatValue(-12.25), "-12.25");
  EXPECT_EQ(FormatValue(0), "0");
  EXPECT_EQ(FormatValue(1.0 / 3), "0.333333333");
  EXPECT_EQ(FormatValue(53 * 0.1), "5.3");
  EXPECT_EQ(FormatValue(1834523.25), "1834523.25");
  EXPECT_EQ(FormatValue(4294967295), "4294967295");
  EXPECT_EQ(FormatValue(std::numeric_limits<double>::quiet_NaN()), "-");
}

TEST(LiveTable, FormatsAges) {
  EXPECT_EQ(FormatAge(-1s), "0.0 s");
  EXPECT_EQ(FormatAge(340ms), "0.3 s");
  EXPECT_EQ(FormatAge(12s), "12 s");
  EXPECT_EQ(FormatAge(5min), "5 min");
  EXPECT_EQ(FormatAge(3h), "3 h");
  EXPECT_EQ(FormatAge(49h), "2 d");
}

TEST(ColumnLayout, PutsColumnsSideBySideWhereTheyFit) {
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

TEST(ColumnLayout, IsUsedByBothKindsOfTables) {
  std::ostringstream out;
  StreamTable stream({{"point", 36}, {"count", 8, true}, {"reason"}}, 30);
  stream.Print({{"bay-1.a", "12", "one two three four five six"}}, out);
  TextTable table({"point", "none", "text"});
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

TEST(LiveScreen, RestoresTheTerminal) {
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

TEST(StreamTable, HasOneHeaderWhileTheColumnsAreWideEnough) {
  StreamTable table({{"point", 8}, {"outcome"}, {"reason"}});
  std::ostringstream out;
  table.Print({{"a", "ok", ""}}, out);
  table.Print({}, out);
  table.Print({{"bb\u00B0", "denied", "as long as it likes, without a column behind it"}}, out);
  EXPECT_EQ(out.str(),
            "point     outcome  reason\n"
            "a         ok\n"
            "bb\u00B0       denied   as long as it likes, without a column behind it\n");
}

TEST(StreamTable, RepeatsItsHeaderWhenAColumnGrows) {
  StreamTable table({{"point"}, {"outcome"}});
  std::ostringstream out;
  table.Print({{"a", "ok"}, {"bay-1.a", "ok"}}, out);
  table.Print({{"bay-1.feeder", "ok"}}, out);
  table.Print({{"b", "ok"}}, out);
  EXPECT_EQ(out.str(),
            "point    outcome\n"
            "a        ok\n"
            "bay-1.a  ok\n"
            "point         outcome\n"
            "bay-1.feeder  ok\n"
            "b             ok\n");
}

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
}  // namespace baudgate::tools
