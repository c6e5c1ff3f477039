// Reasons, cut to what a first sentence has room for.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/diagnosis/causes/words.h"

namespace baudgate::control {
namespace {

TEST(Reason, IsShortened) {
  const struct {
    std::string reason;
    std::string text;
  } rows[] = {
      {"checksum", "checksum"},
      {"exception 0B; it is silent", "exception 0B"},
      {"the module answers '?01' to #: it does not know this command, or the channel is disabled",
       "the module answers '?01' to #"},
      {"no number in 'OL'", "no number in 'OL'"},
      {"reply '!01+01.500+02.500+03.500C4\\r' has another form",
       "reply '!01+01.500+0...' has another form"},
      {"it says 'J\\x00\\x00\\x00\\n8.0.36'", "it says 'J\\x00\\x00...'"},
  };
  for (const auto& row : rows) EXPECT_EQ(Shortened(row.reason), row.text);
}

}  // namespace
}  // namespace baudgate::control
