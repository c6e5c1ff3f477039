// Times as users ask for what has been.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/base/outcome.h"
#include "gateway/base/time.h"

namespace baudgate {
namespace {

TEST(Since, ReadsTimesAndPartsOfThem) {
  const WallTime day = std::chrono::sys_days(std::chrono::year(2026) / 11 / 21);
  EXPECT_EQ(ParseWallTime("2026-11-21").value(), day);
  EXPECT_EQ(ParseWallTime("2026-11-21T01:14").value(), day + 1h + 14min);
  EXPECT_EQ(ParseWallTime("2026-11-21 01:14:31Z").value(), day + 1h + 14min + 31s);
  const WallTime whole = day + 1h + 14min + 31s + 250ms;
  EXPECT_EQ(ParseWallTime(FormatWallTime(whole)).value(), whole);
}

TEST(Since, RefusesWhatIsNone) {
  for (const char* text :
       {"", "Z", "2026", "2026-11", "2026-13-01", "2026-02-30", "2026-11-21T", "2026-11-21T01",
        "2026-11-21T24:00", "2026-11-21T01:60", "2026-11-21T01:14:31.2", "2026-11-21x",
        "-026-11-21", "2026-11-21T01:14:31.250ZZ", "1969-12-31", "2026-+1-21"}) {
    EXPECT_FALSE(ParseWallTime(text)) << text;
  }
}

TEST(Since, ASpanIsBeforeNow) {
  const WallTime now = WallTime(100h);
  EXPECT_EQ(ParseSince("2h", now).value(), now - 2h);
  EXPECT_EQ(ParseSince("1970-01-02", now).value(), WallTime(24h));
  EXPECT_FALSE(ParseSince("yesterday", now));
  EXPECT_EQ(ParseSince("99999999d", now).error(), "'99999999d' is too long");
  EXPECT_EQ(ParseSince("1,5h", now).error(), "'1,5h' has a decimal comma; write 1.5h");
}

TEST(WriteResult, OfOnePointOfSeveral) {
  const WriteResult whole{.end = WriteEnd::refused, .reason = "no", .written = 1, .tried = 3};
  EXPECT_EQ(ResultOf(whole, 0).end, WriteEnd::ok);
  EXPECT_EQ(ResultOf(whole, 1).end, WriteEnd::refused);
  EXPECT_EQ(ResultOf(whole, 2).end, WriteEnd::refused) << "in the same exchange";
  EXPECT_EQ(ResultOf(whole, 3).end, WriteEnd::not_sent);
  EXPECT_EQ(ResultOf({.end = WriteEnd::denied}, 5).end, WriteEnd::denied);
}

}  // namespace
}  // namespace baudgate
