// What is remembered of the clients of transparent routes.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/poll/routed_side.h"

#include <gtest/gtest.h>

#include "gateway/base/text.h"

namespace baudgate {
namespace {

constexpr Instant kNow = Instant() + 1h;
constexpr const char* kRead = "03 00 00 00 01";

class RoutedSideTest : public ::testing::Test {
 protected:
  RoutedSideTest() {
    slave_.slave = 20;
    carrier_.is_common = [](View pdu) { return pdu[0] == 3; };
  }
  void Push(const std::string& pdu) {
    RoutedRequest request;
    request.slave = slave_.slave;
    request.pdu = ParseHex(pdu).value();
    request.deadline = kNow + 10s;
    side_.queue().Push(std::move(request));
  }
  std::size_t Refuse(std::size_t keep = 0) {
    return side_.TakeHopeless(slave_, keep, carrier_, kNow).size();
  }

  Member slave_;
  PduCarrier carrier_;
  RoutedSide side_;
};

TEST_F(RoutedSideTest, ClientsAreHereForTwoSecondsAfterAnAnswer) {
  EXPECT_FALSE(side_.ClientsAreHere(kNow));
  side_.OnAnswered(kNow);
  EXPECT_TRUE(side_.ClientsAreHere(kNow + 1999ms));
  EXPECT_FALSE(side_.ClientsAreHere(kNow + 2s));
}

TEST_F(RoutedSideTest, ReadsOfASlaveThatIsOfflineAreTakenButForItsProbe) {
  Push(kRead);
  Push("06 00 08 00 00");
  Push(kRead);
  EXPECT_EQ(Refuse(1), 1U);
  EXPECT_TRUE(side_.queue().HasShortWrite()) << "writes wait for their deadlines";
  EXPECT_EQ(Refuse(0), 1U);
}

TEST_F(RoutedSideTest, ARefusedReadIsRepeatedInNobodysName) {
  EXPECT_FALSE(side_.MayRepeatRead(slave_, true, kNow));
  Push(kRead);
  Refuse();
  ASSERT_TRUE(side_.MayRepeatRead(slave_, true, kNow));
  const RouteQueue::Batch batch = side_.RepeatRead(slave_);
  ASSERT_EQ(batch.size(), 1U);
  EXPECT_EQ(ToHex(batch[0].pdu), kRead);
  EXPECT_EQ(batch[0].slave, 20);
  batch[0].done({});
  EXPECT_TRUE(side_.queue().empty());
}

TEST_F(RoutedSideTest, AtOnceForTwoSecondsThenOnlyBehindAnotherExchange) {
  Push(kRead);
  Refuse();
  EXPECT_TRUE(side_.MayRepeatRead(slave_, false, kNow + 1999ms));
  EXPECT_FALSE(side_.MayRepeatRead(slave_, false, kNow + 2s));
  EXPECT_TRUE(side_.MayRepeatRead(slave_, true, kNow + 59s));
  EXPECT_FALSE(side_.MayRepeatRead(slave_, true, kNow + 60s));
}

/// Silence to it would say nothing: `is_common` is true for function 3 only.
TEST_F(RoutedSideTest, WhatManySlavesIgnoreIsNotRepeated) {
  Push("04 00 00 00 01");
  EXPECT_EQ(Refuse(), 1U);
  EXPECT_FALSE(side_.MayRepeatRead(slave_, true, kNow));
}

}  // namespace
}  // namespace baudgate
