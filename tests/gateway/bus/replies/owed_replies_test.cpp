// Tests of `OwedReplies`: how replies that have not come yet change an exchange.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <string_view>

#include "gateway/bus/replies/whose_reply.h"
#include "tests/gateway/bus/poller/part_fixture.h"
#include "tests/support/times.h"

namespace baudgate::bus {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

protocols::Request Identification() {
  protocols::Request request = AskFor("PA0\r");
  request.steady = true;
  return request;
}

TEST(LatestReadings, ContainEachPointOnceSinceTheLineRested) {
  LatestReadings readings;
  readings.OnStored({0, {0}});
  readings.OnRested();
  for (const std::size_t point : {1, 2, 1}) readings.OnStored({0, {point}});
  using Points = LatestReadings::Points;
  EXPECT_THAT(readings.TakeAll(), ElementsAre(Points{0, {1}}, Points{0, {2}}));
  EXPECT_THAT(readings.TakeAll(), IsEmpty()) << "told once";
}

/// An outstanding reply to another master counts as lost at once. An outstanding reply to this
/// gateway counts as lost after ten seconds, or after twice the device's `ceiling` (its timeout of
/// the whole exchange) if that is longer.
TEST(WhoseReplyOfAWriter, AWriteOnlyDeviceWithoutProbesHasNoLastingOutstandingReplies) {
  const config::Line line = ToyLine({ToyDevice("a", "A", {"V1"}), ToyDevice("b", "B", {"1"})});
  Roster roster(line, 0,
                [](const std::string&) -> const protocols::Protocol& { return ToyProtocol(); });
  Device& written = roster.device(0);
  Device& read = roster.device(1);
  ReplyOrders orders(roster);
  WhoseReply order(roster, orders);
  const protocols::Request write = AskFor("WA1=7\r");
  const auto owed = [&](Device& device, Duration later) {
    const Asked asked{.member = &device, .request = &write, .writes = true};
    order.OnSent(asked, kStart);
    order.OnNoProof(device, kStart + later);
    return orders.Owed(asked);
  };
  EXPECT_TRUE(order.IsProbedByWrites(written));
  EXPECT_FALSE(order.IsProbedByWrites(read));
  order.OnOpened(written, kStart);
  EXPECT_EQ(owed(written, 10s), 1) << "no stranger's";
  EXPECT_EQ(owed(written, 10s + 1ms), 0);
  written.times.ceiling = 6s;
  EXPECT_EQ(owed(written, 12s), 1);
  EXPECT_EQ(owed(written, 12s + 1ms), 0);
  EXPECT_EQ(owed(read, 1h), 1) << "it is asked again until its reply must be its own";
  const protocols::Request name = Identification();
  const Asked probe{.member = &written, .request = &name, .probe = true};
  order.OnSent(probe, kStart);
  order.OnReply(probe, ToyReply("A0"), Outcome::ok);
  EXPECT_FALSE(order.IsProbedByWrites(written)) << "it knows a probe";
  protocols::Request longer = AskFor("UA9\r");
  longer.unlike_polls = true;
  const Asked read_probe{.member = &written, .request = &longer, .probe = true};
  orders.Reset(written);
  order.OnOpened(written, kStart);
  for (int i = 0; i < 4; ++i) {
    order.OnSent(read_probe, kStart);
    order.OnReply(read_probe, ToyReply("=1"), Outcome::ok);
  }
  EXPECT_EQ(orders.Owed(read_probe), 0) << "it has no polls that are answered alike";
}

class OwedRepliesTest : public ::testing::Test, protected ToyMembers {
 protected:
  Exchange Give(bool trusted = false, Duration idle_for = 0s) {
    return owed_.ExchangeOf(asked_, trusted, kStart - idle_for, kStart);
  }
  void BeLate(Duration lateness) {
    asked_.sent = kStart - 10s;
    const Instant end = asked_.sent_out() + a.times.reply;
    owed_.late_replies.OnEnded(asked_, {Outcome::no_reply, {}, {}, 0}, true, end);
    owed_.late_replies.OnStray({9, lateness}, end + lateness);
  }

  OwedReplies owed_{roster};
  protocols::Request request_ = AskFor("UA1\r");
  Asked asked_{.member = &a, .request = &request_, .sent = kStart};
};

TEST_F(OwedRepliesTest, WithoutOutstandingRepliesTheTimesOfTheDeviceApply) {
  const Exchange exchange = Give();
  EXPECT_EQ(exchange.times.quiet, a.times.quiet);
  EXPECT_EQ(exchange.times.reply, 200ms);
  EXPECT_EQ(exchange.times.ceiling, 1s);
  EXPECT_EQ(exchange.times.drain, 50ms);
  EXPECT_EQ(exchange.aftermath, 0s);
  EXPECT_FALSE(exchange.lags);
}

TEST_F(OwedRepliesTest, ARequestMayNeedMoreTime) {
  request_.reply = 3s;
  request_.quiet = a.times.quiet + 1s;
  const Exchange exchange = Give();
  EXPECT_EQ(exchange.times.quiet, a.times.quiet + 1s);
  EXPECT_EQ(exchange.times.reply, 3s);
  EXPECT_EQ(exchange.times.ceiling, 3800ms) << "the ceiling begins later, and is as long";
}

TEST_F(OwedRepliesTest, ALateDeviceGetsMoreReplyTimeAndMoreDrain) {
  for (int i = 0; i < 2; ++i) BeLate(100ms);
  EXPECT_EQ(Give().times.reply, 325ms) << "a quarter more than it was late";
  EXPECT_EQ(Give().times.drain, 120ms) << "100 ms and a gap";
  EXPECT_EQ(Give().times.ceiling, 1s);
  asked_.lone_probe = true;
  EXPECT_EQ(Give().times.reply, 200ms);
}

TEST_F(OwedRepliesTest, ATrustedDeviceHasNoOutstandingRepliesBeforeAFirstTry) {
  for (const bool trusted : {false, true}) {
    for (const bool retry : {false, true}) {
      owed_.whose.OnSent(asked_, kStart);
      asked_.retry = retry;
      Give(trusted);
      EXPECT_EQ(owed_.orders.Owed(asked_), trusted && !retry ? 0 : 1) << trusted << retry;
      owed_.orders.Reset(a);
    }
  }
}

/// The late reply arrives only after the next request, so waiting for the ceiling of 1 s is
/// useless.
TEST_F(OwedRepliesTest, ALaggingDeviceGetsOnlyTheDrainAsAftermath) {
  BeLate(100ms);
  asked_.sent = kStart - 5s;
  owed_.late_replies.OnEnded(asked_, {Outcome::no_reply, {}, {}, 0}, true, kStart - 4800ms);
  asked_.retry = true;
  EXPECT_EQ(Give().aftermath, 1s);
  const protocols::Request name = Identification();
  const Asked probe{.member = &a, .request = &name, .probe = true};
  for (const std::string_view reply : {"A0", "A0", "A0"}) {
    owed_.whose.OnSent(probe, kStart);
    owed_.whose.OnSent(probe, kStart);
    owed_.whose.OnReply(probe, ToyReply(reply), Outcome::ok);
  }
  ASSERT_TRUE(owed_.whose.Lags(a));
  EXPECT_TRUE(Give().lags);
  EXPECT_EQ(Give().aftermath, a.times.drain);
}

TEST_F(OwedRepliesTest, AfterASilenceOfTheLongestReplyTimeNoReadingIsInDoubt) {
  b.times.reply = 400ms;
  owed_.readings.OnStored({0, {0}});
  Give(false, 399ms);
  EXPECT_EQ(owed_.readings.TakeAll().size(), 1U);
  owed_.readings.OnStored({0, {0}});
  Give(false, 400ms);
  EXPECT_THAT(owed_.readings.TakeAll(), IsEmpty());
}

}  // namespace
}  // namespace baudgate::bus
