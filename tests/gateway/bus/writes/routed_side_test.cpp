// What is remembered of the clients of transparent routes.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/base/text.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/writes/route_queue.h"
#include "tests/support/times.h"

namespace baudgate {
namespace {

constexpr const char* kReadOne = "03 00 00 00 01";

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
    request.deadline = kStart + 10s;
    queue_.Push(std::move(request));
  }
  std::size_t Refuse(std::size_t keep = 0) {
    return side_.TakeHopeless(slave_, keep, carrier_, kStart).size();
  }

  Member slave_;
  PduCarrier carrier_;
  RouteQueue queue_;
  RoutedSide side_{queue_};
};

TEST_F(RoutedSideTest, ClientsAreHereForTwoSecondsAfterAnAnswer) {
  EXPECT_FALSE(side_.ClientsAreHere(kStart));
  side_.OnAnswered(kStart);
  EXPECT_TRUE(side_.ClientsAreHere(kStart + 1999ms));
  EXPECT_FALSE(side_.ClientsAreHere(kStart + 2s));
}

TEST_F(RoutedSideTest, ReadsOfASlaveThatIsOfflineAreTakenButForItsProbe) {
  Push(kReadOne);
  Push("06 00 08 00 00");
  Push(kReadOne);
  EXPECT_EQ(Refuse(1), 1U);
  EXPECT_TRUE(queue_.HasAny(RouteQueue::IsShortWrite)) << "writes wait for their deadlines";
  EXPECT_EQ(Refuse(0), 1U);
}

TEST_F(RoutedSideTest, ARefusedReadIsRepeatedInNobodysName) {
  EXPECT_FALSE(side_.MayRepeatRead(slave_, true, kStart));
  Push(kReadOne);
  Refuse();
  ASSERT_TRUE(side_.MayRepeatRead(slave_, true, kStart));
  const RouteQueue::Batch batch = side_.RepeatRead(slave_);
  ASSERT_EQ(batch.size(), 1U);
  EXPECT_EQ(ToHex(batch[0].pdu), kReadOne);
  EXPECT_EQ(batch[0].slave, 20);
  batch[0].done({});
  EXPECT_TRUE(queue_.empty());
}

TEST_F(RoutedSideTest, AtOnceForTwoSecondsThenOnlyBehindAnotherExchange) {
  Push(kReadOne);
  Refuse();
  EXPECT_TRUE(side_.MayRepeatRead(slave_, false, kStart + 1999ms));
  EXPECT_FALSE(side_.MayRepeatRead(slave_, false, kStart + 2s));
  EXPECT_TRUE(side_.MayRepeatRead(slave_, true, kStart + 59s));
  EXPECT_FALSE(side_.MayRepeatRead(slave_, true, kStart + 60s));
}

/// Silence to it would say nothing: `is_common` is true for function 3 only.
TEST_F(RoutedSideTest, WhatManySlavesIgnoreIsNotRepeated) {
  Push("04 00 00 00 01");
  EXPECT_EQ(Refuse(), 1U);
  EXPECT_FALSE(side_.MayRepeatRead(slave_, true, kStart));
}

}  // namespace
}  // namespace baudgate
