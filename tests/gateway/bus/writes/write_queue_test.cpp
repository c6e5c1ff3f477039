// Tests of `WriteQueue` and `RoutedSide`.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/writes/write_queue.h"

#include <gtest/gtest.h>

#include "gateway/base/text.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/writes/route_queue.h"
#include "tests/support/times.h"

namespace baudgate::bus {
namespace {

bool Nobody(std::size_t /*device*/) { return false; }

WriteCommand To(std::uint32_t device, Duration deadline = 10s) {
  WriteCommand command;
  command.device = device;
  command.deadline = kStart + deadline;
  return command;
}

bool Any(const WriteCommand&) { return true; }

TEST(WriteQueue, KeepsAndNumbersTheOrderOfArrival) {
  WriteQueue queue;
  EXPECT_EQ(queue.NextSequence(), 1U);
  queue.Push(To(5));
  queue.Push(To(6));
  const auto first = queue.Take(Any);
  ASSERT_TRUE(first);
  EXPECT_EQ(first->device, 5U);
  EXPECT_EQ(first->sequence, 2U);
  EXPECT_EQ(queue.Take(Any)->sequence, 3U);
  EXPECT_FALSE(queue.Take(Any));
}

TEST(WriteQueue, ADeviceThatMayNotBeAskedDoesNotBlockOthers) {
  WriteQueue queue;
  queue.Push(To(5));
  queue.Push(To(6));
  EXPECT_EQ(queue.Take([](const WriteCommand& command) { return command.device != 5; })->device,
            6U);
  EXPECT_FALSE(queue.empty());
}

TEST(WriteQueue, IsFullAtItsLimit) {
  WriteQueue queue;
  for (std::size_t i = 0; i < WriteQueue::kLimit; ++i) {
    EXPECT_FALSE(queue.full());
    queue.Push(To(0));
  }
  EXPECT_TRUE(queue.full());
}

TEST(WriteQueue, AWriteIsAnsweredOnceItHasBeenReadBack) {
  WriteQueue queue;
  queue.AddReadBack({1, 4});
  queue.AddReadBack({1, 4});
  queue.Confirm(To(1), 1, kStart);
  queue.Confirm(To(2), 2, kStart);
  EXPECT_EQ(queue.TakeConfirmed(Nobody).size(), 1U) << "nothing of this device is";
  EXPECT_TRUE(queue.TakeConfirmed(Nobody).empty()) << "its query is still to be read";
  const auto may_read = [](std::size_t) { return true; };
  EXPECT_EQ(queue.TakeReadBack(may_read), (QueryRef{1, 4}));
  EXPECT_FALSE(queue.TakeReadBack(may_read)) << "once is enough";
  EXPECT_TRUE(queue.TakeConfirmed([](std::size_t device) { return device == 1; }).empty())
      << "it is being read";
  EXPECT_EQ(queue.TakeConfirmed(Nobody).size(), 1U);
  EXPECT_TRUE(queue.TakeConfirmed(Nobody).empty());
}

TEST(WriteQueue, APointWrittenAgainIsNoLongerCompared) {
  WriteQueue queue;
  WriteCommand command = To(1);
  command.kind = Writes{{4, Value(1.0)}, {5, Value(2.0)}};
  queue.Confirm(std::move(command), 1, kStart);
  queue.OnBegun(2, 4);
  queue.OnBegun(1, 4);
  const auto confirmed = queue.TakeConfirmed(Nobody);
  ASSERT_EQ(confirmed.size(), 1U);
  EXPECT_EQ(confirmed[0].written, 2U);
  EXPECT_TRUE(confirmed[0].replaced);
  ASSERT_EQ(confirmed[0].command.writes().size(), 1U);
  EXPECT_EQ(confirmed[0].command.writes()[0].point, 5U);
}

TEST(WriteQueue, OnlyTheLastValueOfAPointWrittenTwiceIsCompared) {
  WriteQueue queue;
  WriteCommand command = To(1);
  command.kind = Writes{{4, Value(1.0)}, {5, Value(2.0)}, {4, Value(3.0)}};
  queue.Confirm(std::move(command), 1, kStart);
  const auto confirmed = queue.TakeConfirmed(Nobody);
  ASSERT_EQ(confirmed[0].command.writes().size(), 2U);
  EXPECT_EQ(confirmed[0].command.writes()[0].point, 5U);
  EXPECT_EQ(confirmed[0].command.writes()[1].raw, Value(3.0));
  EXPECT_EQ(confirmed[0].written, 3U);
  EXPECT_FALSE(confirmed[0].replaced);
}

TEST(WriteQueue, ReadBacksWaitForTheirDevice) {
  WriteQueue queue;
  queue.AddReadBack({1, 0});
  queue.AddReadBack({2, 7});
  EXPECT_EQ(queue.TakeReadBack([](std::size_t device) { return device == 2; }), (QueryRef{2, 7}));
}

TEST(WriteQueue, ExpiredCommandsAreRemoved) {
  WriteQueue queue;
  queue.Push(To(1, 2s));
  queue.Push(To(2, 1s));
  queue.Confirm(To(3, 3s), 3, kStart);
  EXPECT_EQ(queue.Deadline(), kStart + 1s);
  WriteQueue::Expired expired = queue.TakeExpired(kStart + 1s);
  ASSERT_EQ(expired.unsent.size(), 1U);
  EXPECT_EQ(expired.unsent[0].device, 2U);
  EXPECT_TRUE(expired.confirmed.empty());
  expired = queue.TakeExpired(kStart + 3s);
  EXPECT_EQ(expired.unsent.size(), 1U);
  EXPECT_EQ(expired.confirmed.size(), 1U);
  EXPECT_FALSE(queue.Deadline());
}

TEST(WriteQueue, AClosedPortEndsAllCommands) {
  WriteQueue queue;
  queue.Push(To(1));
  queue.AddReadBack({1, 0});
  queue.Confirm(To(2), 2, kStart);
  EXPECT_EQ(queue.TakeAll().size(), 1U);
  EXPECT_EQ(queue.TakeConfirmed(Nobody).size(), 1U);
}

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
  protocols::PduCarrier carrier_;
  RouteQueue queue_;
  RoutedSide side_{queue_};
};

TEST_F(RoutedSideTest, ClientsCountAsPresentForTwoSecondsAfterAnAnswer) {
  EXPECT_FALSE(side_.ClientsAreHere(kStart));
  side_.OnAnswered(kStart);
  EXPECT_TRUE(side_.ClientsAreHere(kStart + 1999ms));
  EXPECT_FALSE(side_.ClientsAreHere(kStart + 2s));
}

TEST_F(RoutedSideTest, ReadsOfAnOfflineSlaveAreRefusedExceptItsProbe) {
  Push(kReadOne);
  Push("06 00 08 00 00");
  Push(kReadOne);
  EXPECT_EQ(Refuse(1), 1U);
  EXPECT_TRUE(queue_.HasAny(RouteQueue::IsShortWrite)) << "writes wait for their deadlines";
  EXPECT_EQ(Refuse(0), 1U);
}

TEST_F(RoutedSideTest, ARefusedReadIsRepeatedWithoutAClient) {
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

TEST_F(RoutedSideTest, ARefusedReadIsRepeatedAtOnceForTwoSecondsThenAfterAnExchange) {
  Push(kReadOne);
  Refuse();
  EXPECT_TRUE(side_.MayRepeatRead(slave_, false, kStart + 1999ms));
  EXPECT_FALSE(side_.MayRepeatRead(slave_, false, kStart + 2s));
  EXPECT_TRUE(side_.MayRepeatRead(slave_, true, kStart + 59s));
  EXPECT_FALSE(side_.MayRepeatRead(slave_, true, kStart + 60s));
}

TEST_F(RoutedSideTest, AReadThatManySlavesIgnoreIsNotRepeated) {
  Push("04 00 00 00 01");
  EXPECT_EQ(Refuse(), 1U);
  EXPECT_FALSE(side_.MayRepeatRead(slave_, true, kStart));
}

}  // namespace
}  // namespace baudgate::bus
