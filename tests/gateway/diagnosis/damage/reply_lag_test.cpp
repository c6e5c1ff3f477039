// The table of reply_lag.h.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <optional>
#include <vector>

#include "gateway/diagnosis/damage/reply_habits.h"

namespace baudgate {
namespace {

struct Late {
  Duration after;
  std::optional<Duration> next = 12ms;
};

bool LagsBehind(const std::vector<Late>& replies) {
  ReplyLag lag;
  bool lags = false;
  for (const Late& reply : replies) lags = lag.OnLate(reply.after, reply.next);
  return lags;
}

TEST(ReplyLag, Table) {
  EXPECT_FALSE(LagsBehind({{620ms, std::nullopt}}));
  EXPECT_FALSE(LagsBehind({{900ms}, {1400ms}, {700ms}})) << "three may be chance";
  EXPECT_TRUE(LagsBehind({{900ms}, {1400ms}, {700ms}, {950ms}}));
  EXPECT_TRUE(LagsBehind({{900ms}, {900ms}, {900ms}, {1400ms}}));
  EXPECT_TRUE(LagsBehind({{900ms}, {900ms}, {900ms, 13ms}, {950ms}}));
  EXPECT_FALSE(LagsBehind({{900ms}, {910ms, 22ms}, {905ms, 17ms}, {900ms}}))
      << "it is always as late";
  EXPECT_FALSE(LagsBehind({{900ms}, {960ms, 42ms}, {905ms, 17ms}, {900ms}})) << "or nearly so";
}

TEST(ReplyLag, OneThatComesByItselfBeginsANewCount) {
  const std::vector<Late> replies = {{900ms}, {1400ms}, {700ms}, {800ms, std::nullopt},
                                     {900ms}, {1400ms}, {700ms}};
  EXPECT_FALSE(LagsBehind(replies));
}

}  // namespace
}  // namespace baudgate
