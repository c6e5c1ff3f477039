// Unit 0: who it is, and when a write to it is for all slaves.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "tests/gateway/outputs/modbus/service/service_fixture.h"

namespace baudgate::modbus {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr const char* kStopAll = "06 00 08 00 00";
constexpr const char* kReadStatus = "03 23 28 00 01";
constexpr const char* kStatus = "12 34 00 00 00 05 00 03 02 00 00";
constexpr const char* kNotHere = "12 34 00 00 00 03 00 86 02";

class BroadcastTest : public ServiceTest {
 protected:
  void Pass() { listener().broadcast = config::Listener::Broadcast::pass; }
};

TEST_F(BroadcastTest, ByDefaultUnitZeroIsTheGateway) {
  Add(1, 20, 20);
  EXPECT_THAT(Ask(0, kStopAll), ElementsAre(kNotHere));
  EXPECT_THAT(Ask(0, kReadStatus), ElementsAre(kStatus));
  EXPECT_EQ(drive_.count(), 0U);
}

TEST_F(BroadcastTest, PassedOnItReachesEveryRoutedLineOnceAndIsNeverAnswered) {
  Pass();
  Add(1, 20, 20).deadline = 700ms;
  Add(2, 30, 30);
  Add(1, 21, 21).deadline = 900ms;
  EXPECT_THAT(Ask(0, kStopAll), ElementsAre("nothing"));
  ASSERT_EQ(drive_.count(), 1U);
  ASSERT_EQ(pumps_.count(), 1U);
  const RoutedRequest request = drive_.Wait(0);
  EXPECT_EQ(request.slave, 0);
  EXPECT_TRUE(request.broadcast);
  EXPECT_EQ(ToHex(request.pdu), kStopAll);
  EXPECT_EQ(request.deadline, now_ + 700ms);
  now_ += 1h;
  request.done(GoodReply(Bytes{}));
  pumps_.Wait(0).done(Trouble(Outcome::no_reply, "waited too long", false));
  EXPECT_THAT(Settle(), IsEmpty());
  const RouteStatus counted = Traffic().routes.back();
  EXPECT_EQ(counted.units, "0");
  EXPECT_EQ(counted.requests, 2U) << "one per line";
  EXPECT_EQ(counted.broadcasts, 1U);
  EXPECT_EQ(counted.expired, 1U);
}

TEST_F(BroadcastTest, OnlyWritesAreBroadcast) {
  Pass();
  Add(1, 20, 20);
  EXPECT_THAT(Ask(0, kReadStatus), ElementsAre(kStatus));
  EXPECT_THAT(Ask(0, "08 00 00 00 00"), ElementsAre("12 34 00 00 00 03 00 88 01"));
  EXPECT_THAT(Ask(0, "17 00 00 00 01 00 00 00 01 02 00 00"),
              ElementsAre("12 34 00 00 00 03 00 97 01"));
  EXPECT_EQ(drive_.count(), 0U);
  for (const char* write :
       {"05 00 01 FF 00", "06 00 01 00 02", "0F 00 00 00 01 01 01", "10 00 00 00 01 02 00 01"}) {
    EXPECT_THAT(Ask(0, write), ElementsAre("nothing"));
  }
  EXPECT_EQ(drive_.count(), 4U);
}

TEST_F(BroadcastTest, PermissionCountsForBroadcastsToo) {
  Pass();
  listener().permit = config::Permit::read;
  Add(1, 20, 20);
  EXPECT_THAT(Ask(0, kStopAll), ElementsAre("12 34 00 00 00 03 00 86 01"));
  EXPECT_EQ(drive_.count(), 0U);
}

TEST_F(BroadcastTest, ARouteOfUnitZeroSendsItToItsOwnLineOnly) {
  Pass();
  Add(1, 20, 20);
  Add(2, 0, 0);
  EXPECT_THAT(Ask(0, kStopAll), ElementsAre("nothing"));
  EXPECT_EQ(drive_.count(), 0U);
  EXPECT_EQ(pumps_.Wait(0).slave, 0);
  EXPECT_THAT(Ask(0, kReadStatus), ElementsAre(kStatus));
  listener().broadcast = config::Listener::Broadcast::ignore;
  EXPECT_THAT(Ask(0, kStopAll), ElementsAre(kNotHere));
  EXPECT_EQ(pumps_.count(), 1U);
}

TEST_F(BroadcastTest, ARouteThatRemapsUnitZeroMakesItAnOrdinaryRequest) {
  Add(1, 0, 0).remap = 7;
  Ask(0, kStopAll);
  EXPECT_EQ(drive_.Wait(0).slave, 7);
  drive_.Wait(0).done(GoodReply(std::string(kStopAll)));
  EXPECT_THAT(Settle(), ElementsAre("12 34 00 00 00 06 00 06 00 08 00 00"));
  Ask(0, kReadStatus);
  EXPECT_EQ(ToHex(drive_.Wait(1).pdu), kReadStatus);
}

TEST_F(BroadcastTest, AnRtuMasterIsNotAnsweredEvenWhereOneSlaveIsMeant) {
  listener().framing = Framing::rtu;
  Add(1, 0, 0).remap = 7;
  for (const RoutedReply& reply : {GoodReply(std::string(kStopAll)), SlaveException("86 02"),
                                   Trouble(Outcome::no_reply, "")}) {
    EXPECT_THAT(Ask(0, kStopAll), IsEmpty());
    drive_.Wait(drive_.count() - 1).done(reply);
    EXPECT_THAT(Settle(), ElementsAre("nothing"));
  }
  Ask(0, kReadStatus);
  drive_.Wait(3).done(GoodReply("03 02 00 07"));
  EXPECT_THAT(Settle(), ElementsAre("12 34 00 00 00 05 00 03 02 00 07"));
}

TEST_F(BroadcastTest, WhoBroadcastsMayLeaveAtOnce) {
  Pass();
  Add(1, 20, 20);
  Ask(0, kStopAll);
  const std::uint64_t id = IdOf(0);
  EXPECT_NE(drive_.Wait(0).client, id);
  services_[0]->Close();
  services_.clear();
  EXPECT_THAT(drive_.forgotten(), IsEmpty());
  drive_.Wait(0).done(GoodReply(Bytes{}));
  Settle();
  EXPECT_EQ(Traffic().routes.back().broadcasts, 1U);
}

TEST_F(BroadcastTest, OneClientMayNotFillTheQueuesWithBroadcasts) {
  Pass();
  Add(1, 20, 20);
  for (std::size_t i = 0; i < PendingRequests::kMost + 5; ++i) Ask(0, kStopAll);
  EXPECT_EQ(drive_.count(), PendingRequests::kMost);
  EXPECT_EQ(Traffic().routes.back().busy, 5U);
  drive_.Wait(0).done(GoodReply(Bytes{}));
  Settle();
  Ask(0, kStopAll);
  EXPECT_EQ(drive_.count(), PendingRequests::kMost + 1);
}

TEST_F(BroadcastTest, AnRtuMasterIsNeverAnsweredABroadcast) {
  listener().framing = Framing::rtu;
  Add(1, 20, 20);
  EXPECT_THAT(Ask(0, kStopAll), ElementsAre("nothing"));
  listener().permit = config::Permit::read;
  EXPECT_THAT(Ask(0, kStopAll), ElementsAre("nothing"));
  EXPECT_THAT(Ask(0, kReadStatus), ElementsAre(kStatus));
  EXPECT_EQ(drive_.count(), 0U);
}

}  // namespace
}  // namespace baudgate::modbus
