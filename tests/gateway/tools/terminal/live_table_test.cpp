// Tables of live values as text: alignment, cutting, colours, and nothing that steers a terminal.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/terminal/live_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "gateway/base/shown.h"

namespace baudgate {
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

TEST(LiveTable, CutsVisibly) {
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

TEST(LiveTable, SaysHowManyRowsAreLeftOut) {
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

TEST(LiveTable, ShowsMissingAgeAndPointsThatAreGone) {
  PointRow row = ARow("d", "p", "-");
  row.age.reset();
  row.gone = true;
  const std::string text = RenderPoints({row}, {});
  EXPECT_THAT(text, HasSubstr("gone"));
  EXPECT_THAT(text, Not(HasSubstr("good")));
  EXPECT_TRUE(text.ends_with("-\n"));
}

TEST(LiveTable, LetsNoControlCharacterThrough) {
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

}  // namespace
}  // namespace baudgate
