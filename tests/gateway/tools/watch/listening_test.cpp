// When the subscriber of `watch` is made anew.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/tools/watch/point_feed.h"

namespace baudgate {
namespace {

TEST(Listening, BeginsAnewUntilItSucceeds) {
  dds::OwnAddresses own = {{"10.0.0.5", 2}};
  Status outcome;
  int opened = 0;
  Listening listening(
      {"10.0.0.5"},
      [&] {
        ++opened;
        return outcome;
      },
      [&] { return own; });
  ASSERT_TRUE(listening.Start());
  struct Row {
    Duration at;
    unsigned index;  ///< of the interface; 0: there is none
    const char* outcome;
    std::string told;
    int opened;
  };
  const Row rows[] = {
      {1s, 2, "", "", 1},
      {2s, 0, "", "", 1},
      {2500ms, 7, "", "", 1},  // once a second is enough
      {3s, 7, "no room", "the interface of 10.0.0.5 was made anew; no room", 2},
      {4s, 7, "no room", "", 3},
      {5s, 7, "no port", "no port", 4},
      {6s, 7, "", "begun anew", 5},
      {7s, 7, "", "", 5},
      {8s, 9, "", "the interface of 10.0.0.5 was made anew; begun anew", 6},
  };
  for (const Row& row : rows) {
    own.clear();
    if (row.index != 0) own["10.0.0.5"] = row.index;
    const std::string wrong = row.outcome;
    outcome = wrong.empty() ? Status() : Status(Error{wrong});
    EXPECT_EQ(listening.Look(Instant(row.at)).value_or(""), row.told);
    EXPECT_EQ(listening.failure().value_or(""), wrong) << row.at.count();
    EXPECT_EQ(opened, row.opened);
  }
}

}  // namespace
}  // namespace baudgate
