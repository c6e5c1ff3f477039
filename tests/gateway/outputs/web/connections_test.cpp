// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/outputs/web/http_server.h"

namespace baudgate::web {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr Instant kStart{1h};

TEST(LimitsTest, FewDescriptorsAllowFewConnections) {
  const Limits all;
  EXPECT_EQ(Limits::Of(1000).at_all, all.at_all);
  EXPECT_EQ(Limits::Of(1000).connections, all.connections);
  EXPECT_EQ(Limits::Of(20).at_all, 20U);
  EXPECT_EQ(Limits::Of(20).connections, 16U);
  EXPECT_EQ(Limits::Of(20).of_address, 16U);
  EXPECT_GE(Limits::Of(0).connections, 1U);
}

TEST(Connections, WhoAsksNothingGivesWayToTheNext) {
  Connections all({.at_all = 3});
  EXPECT_EQ(all.Open(1, "10.0.0.1", kStart), std::nullopt);
  EXPECT_EQ(all.Open(2, "10.0.0.2", kStart + 1s), std::nullopt);
  EXPECT_EQ(all.Open(3, "10.0.0.3", kStart + 2s), std::nullopt);
  EXPECT_TRUE(all.Begin(1, kStart));
  EXPECT_EQ(all.Open(4, "10.0.0.4", kStart + 3s), 2) << "1 is answered";
  all.Close(2);
  all.End(1, kStart + 4s);
  EXPECT_EQ(all.Open(5, "10.0.0.5", kStart + 5s), 3);
}

TEST(Connections, ARequestHasTenSecondsToCome) {
  Connections all({});
  all.Open(1, "10.0.0.1", kStart);
  all.Open(2, "10.0.0.2", kStart);
  all.Begin(2, kStart);
  EXPECT_THAT(all.Overdue(kStart + 9s), IsEmpty());
  EXPECT_THAT(all.Overdue(kStart + 10s), ElementsAre(1));
  all.End(2, kStart + 15s);
  EXPECT_THAT(all.Overdue(kStart + 24s), ElementsAre(1));
  EXPECT_THAT(all.Overdue(kStart + 25s), ElementsAre(1, 2));
}

TEST(Connections, AnAnswerHasAMinuteToBeTakenAndAStreamForEver) {
  Connections all({});
  all.Open(1, "10.0.0.1", kStart);
  all.Open(2, "10.0.0.1", kStart);
  all.Begin(1, kStart);
  all.Begin(2, kStart);
  all.Stream(2);
  EXPECT_THAT(all.Overdue(kStart + 59s), IsEmpty());
  EXPECT_THAT(all.Overdue(kStart + 60s), ElementsAre(1));
}

TEST(Connections, SoManyAreAnsweredAtOnce) {
  Connections all({.connections = 4, .of_address = 2});
  for (Connections::Id id = 1; id <= 7; ++id) {
    all.Open(id, id <= 3 ? "10.0.0.1" : "127.0.0.1", kStart);
  }
  EXPECT_TRUE(all.Begin(1, kStart));
  EXPECT_TRUE(all.Begin(2, kStart));
  EXPECT_FALSE(all.Begin(3, kStart)) << "the third of one address";
  all.Close(3);
  EXPECT_TRUE(all.Begin(4, kStart));
  EXPECT_TRUE(all.Begin(5, kStart));
  EXPECT_FALSE(all.Begin(6, kStart)) << "the fifth in all";
  all.Close(6);
  all.End(4, kStart);
  EXPECT_TRUE(all.Begin(7, kStart)) << "this machine has no other limit";
}

}  // namespace
}  // namespace baudgate::web
