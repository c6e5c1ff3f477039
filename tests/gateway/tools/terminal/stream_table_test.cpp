// A table whose rows come one after the other.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <sstream>

#include "gateway/tools/terminal/tables.h"

namespace baudgate {
namespace {

TEST(StreamTable, IsOneTableWhereTheColumnsAreWideEnough) {
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

TEST(StreamTable, GrowsWithWhatComes) {
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

}  // namespace
}  // namespace baudgate
