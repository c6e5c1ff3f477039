// Tests of routed requests: the request that the target gets, and the client's answer to each
// outcome.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/service/client_requests.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/gateway/outputs/modbus/service/service_fixture.h"

namespace baudgate::modbus {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TEST_F(ServiceTest, EveryFunctionIsRoutedUnchanged) {
  Add(1, 20, 20);
  const char* kRequests[] = {"01 00 00 00 08",
                             "02 00 00 00 08",
                             "03 03 E7 00 78",
                             "04 00 00 00 01",
                             "05 00 01 FF 00",
                             "06 00 08 00 02",
                             "07",
                             "08 00 00 A5 37",
                             "0F 00 13 00 0A 02 CD 01",
                             "10 00 01 00 02 04 00 0A 01 02",
                             "11",
                             "16 00 04 00 F2 00 25",
                             "17 00 03 00 06 00 0E 00 01 02 00 FF",
                             "18 04 DE",
                             "2B 0E 01 00",
                             "64 DE AD BE EF",
                             "03",
                             "06 00"};
  std::size_t number = 0;
  for (const char* pdu : kRequests) {
    EXPECT_THAT(Ask(20, pdu), IsEmpty());
    const bus::RoutedRequest request = drive_.Wait(number++);
    EXPECT_EQ(ToHex(request.pdu), pdu);
    EXPECT_EQ(request.slave, 20);
    request.done(GoodReply(std::string(pdu).substr(0, 2) + " 55 AA"));
    EXPECT_THAT(Settle(),
                ElementsAre("12 34 00 00 00 04 14 " + std::string(pdu).substr(0, 2) + " 55 AA"));
  }
}

TEST_F(ServiceTest, AClientThatMayOnlyReadSendsNoBytesBehindItsRequest) {
  Add(1, 20, 20);
  listener().permit = config::Permit::read;
  // A slave that counts bytes would take the rest for a second request, a broadcast of function 6.
  for (const char* pdu : {"03 00 01 00 01 D5 CA 00 06 0F FF 0B AD 7D B2", "03 00 01 00 01 00",
                          "03 00 01 00", "04 00 00 00 00", "01 00 00 07 D1"}) {
    EXPECT_THAT(Ask(20, pdu), ElementsAre(std::string("12 34 00 00 00 03 14 8") + pdu[1] + " 03"))
        << pdu;
  }
  EXPECT_EQ(drive_.count(), 0U);
  EXPECT_THAT(Ask(20, "03 00 01 00 01"), IsEmpty());
  EXPECT_EQ(drive_.count(), 1U);
}

TEST_F(ServiceTest, AClientThatMayOnlyWriteDataSendsOnlyWholeRequests) {
  Add(1, 20, 20);
  listener().permit = config::Permit::data;
  for (const char* pdu : {"06 00 64 00 01 00 C8 00 02", "06 00 64", "0F 00 0A 00 02 02 FF FF",
                          "10 00 0A 00 02 0A 00 01 00 02 00 03 00 04 00 05", "10 00 0A 00 00 00"}) {
    const std::string code = pdu[0] == '1' ? "90" : std::string("8") + pdu[1];
    EXPECT_THAT(Ask(20, pdu), ElementsAre("12 34 00 00 00 03 14 " + code + " 03")) << pdu;
  }
  EXPECT_EQ(drive_.count(), 0U);
  EXPECT_THAT(Ask(20, "10 00 0A 00 01 02 00 01"), IsEmpty());
  EXPECT_EQ(drive_.count(), 1U);
}

TEST_F(ServiceTest, AnInvalidFunctionCodeIsRefused) {
  Add(1, 20, 20);
  EXPECT_THAT(Ask(20, "00 00 00"), ElementsAre("12 34 00 00 00 03 14 80 01"));
  EXPECT_THAT(Ask(20, "83 02"), ElementsAre("12 34 00 00 00 03 14 83 01"));
  EXPECT_EQ(drive_.count(), 0U);
}

TEST_F(ServiceTest, TheLongestAduPassesBothWays) {
  Add(1, 20, 20);
  Bytes pdu(253);
  for (std::size_t i = 0; i < pdu.size(); ++i) pdu[i] = static_cast<std::uint8_t>(i + 0x17);
  drive_.answer = [](const bus::RoutedRequest& request) { return GoodReply(request.pdu); };
  const Bytes frame = AduOf(0xBEEF, 20, pdu);
  ASSERT_EQ(frame.size(), kMaxAdu);
  EXPECT_THAT(Ask(frame), ElementsAre(ToHex(frame)));
}

TEST_F(ServiceTest, RemappedUnitsAreAnsweredUnderTheRequestedUnit) {
  Add(1, 33, 40).remap = 1;
  Ask(34, kRead);
  EXPECT_EQ(drive_.Wait(0).slave, 2);
  drive_.Wait(0).done(GoodReply("03 02 00 07"));
  EXPECT_THAT(Settle(), ElementsAre("12 34 00 00 00 05 22 03 02 00 07"));
  Ask(40, kRead);
  EXPECT_EQ(drive_.Wait(1).slave, 8);
}

TEST_F(ServiceTest, RoutedRequestsCarryClientAndDeadline) {
  Add(1, 20, 20).deadline = 700ms;
  Ask(20, kRead);
  const bus::RoutedRequest request = drive_.Wait(0);
  EXPECT_EQ(request.client, IdOf(0));
  EXPECT_NE(request.client, 0U);
  EXPECT_EQ(request.arrived, now_);
  EXPECT_EQ(request.deadline, now_ + 700ms);
}

TEST_F(ServiceTest, RepliesComeInTheOrderOfCompletionWithTheirTransactionIds) {
  Add(1, 20, 21);
  Add(2, 30, 30);
  for (std::uint16_t i = 0; i < PendingRequests::kMost; ++i) {
    const auto unit = static_cast<std::uint8_t>(i % 3 == 2 ? 30 : 20 + i % 3);
    ASSERT_THAT(Ask(Frame(unit, kRead, static_cast<std::uint16_t>(0xA000 + i))), IsEmpty());
  }
  EXPECT_EQ(services_[0]->outstanding(), PendingRequests::kMost);
  Enter(wire_);
  for (std::size_t i = drive_.count(); i-- > 0;) {
    const bus::RoutedRequest request = drive_.Wait(i);
    request.done(GoodReply(Bytes{3, 2, 0, static_cast<std::uint8_t>(i)}));
    const auto number = static_cast<std::uint8_t>(i / 2 * 3 + i % 2);
    EXPECT_THAT(Settle(),
                ElementsAre("A0 " + HexByte(number) + " 00 00 00 05 " + HexByte(request.slave) +
                            " 03 02 00 " + HexByte(static_cast<std::uint8_t>(i))));
  }
  EXPECT_EQ(services_[0]->outstanding(), pumps_.count());
}

TEST_F(ServiceTest, AClientMayHave32RequestsWaiting) {
  Add(1, 20, 20);
  for (std::uint16_t i = 0; i < 32; ++i) ASSERT_THAT(Ask(Frame(20, kRead, i)), IsEmpty());
  EXPECT_THAT(Ask(Frame(20, kRead, 32)), ElementsAre("00 20 00 00 00 03 14 83 06"));
  EXPECT_THAT(Ask(Frame(1, "06 00 00 00 01", 33)), ElementsAre("00 21 00 00 00 03 01 86 06"));
  EXPECT_THAT(Ask(1, "03 00 00 00 01"), ElementsAre("12 34 00 00 00 05 01 03 02 FF FE"));
  drive_.Wait(7).done(GoodReply("03 02 00 00"));
  EXPECT_THAT(Settle(), ElementsAre("00 07 00 00 00 05 14 03 02 00 00"));
  EXPECT_THAT(Ask(Frame(20, kRead, 34)), IsEmpty());
  KeptWire other;
  Enter(other)->Handle(Frame(20, kRead, 35), Clocks());
  EXPECT_THAT(other.Take(), IsEmpty()) << "others have room of their own";
}

struct RoutedEnding {
  Outcome outcome;
  const char* pdu;
  const char* answer;
};

class RoutedEndings : public ServiceTest, public testing::WithParamInterface<RoutedEnding> {};

TEST_P(RoutedEndings, AreAnsweredByTheContract) {
  Add(1, 20, 20);
  Ask(20, kRead);
  bus::RoutedReply reply = GoodReply(std::string(GetParam().pdu));
  reply.outcome = GetParam().outcome;
  drive_.Wait(0).done(reply);
  EXPECT_THAT(Settle(), ElementsAre("12 34 00 00 00 0" + std::string(GetParam().answer)));
}

INSTANTIATE_TEST_SUITE_P(All, RoutedEndings,
                         testing::Values(RoutedEnding{Outcome::ok, "03 02 00 01",
                                                      "5 14 03 02 00 01"},
                                         RoutedEnding{Outcome::refused, "83 02", "3 14 83 02"},
                                         RoutedEnding{Outcome::refused, "83 0B", "3 14 83 0B"},
                                         RoutedEnding{Outcome::no_reply, "", "3 14 83 0B"},
                                         RoutedEnding{Outcome::partial, "", "3 14 83 0B"},
                                         RoutedEnding{Outcome::corrupt, "", "3 14 83 0B"},
                                         RoutedEnding{Outcome::unexpected, "", "3 14 83 0B"},
                                         RoutedEnding{Outcome::busy, "", "3 14 83 0B"},
                                         RoutedEnding{Outcome::line_down, "", "3 14 83 0B"},
                                         RoutedEnding{Outcome::none, "", "3 14 83 0B"},
                                         RoutedEnding{Outcome::ok, "", "3 14 83 0B"}),
                         [](const auto& info) {
                           return std::string(Name(info.param.outcome)) +
                                  std::to_string(info.index);
                         });

TEST_F(ServiceTest, AnUnservableRequestIsAnsweredAtOnce) {
  Add(1, 20, 20);
  config_.modbus.routes.emplace_back(RouteTo(config_, 0, 21, 21)).line_index = 9;
  drive_.full = true;
  EXPECT_THAT(Ask(20, kRead), ElementsAre("12 34 00 00 00 03 14 83 06"));
  EXPECT_THAT(Ask(21, kRead), ElementsAre("12 34 00 00 00 03 15 83 0A"));
  EXPECT_THAT(Ask(22, kRead), ElementsAre("12 34 00 00 00 03 16 83 0A"));
}

TEST_F(ServiceTest, ASilentListenerSuppressesItsOwnExceptionsOnly) {
  listener().errors = config::Listener::Errors::silent;
  Add(1, 20, 20);
  EXPECT_THAT(Ask(22, kRead), ElementsAre("nothing")) << "0x0A";
  Ask(20, kRead);
  drive_.Wait(0).done(Trouble(Outcome::no_reply, "silence"));
  EXPECT_THAT(Settle(), ElementsAre("nothing")) << "0x0B";
  Ask(20, kRead);
  drive_.Wait(1).done(SlaveException("83 06"));
  EXPECT_THAT(Settle(), ElementsAre("12 34 00 00 00 03 14 83 06"));
  drive_.full = true;
  EXPECT_THAT(Ask(20, kRead), ElementsAre("nothing")) << "0x06";
  EXPECT_THAT(Ask(1, "03 00 09 00 01"), ElementsAre("12 34 00 00 00 03 01 83 02"));
}

/// A reload can remove the device during a request. A client would take zeros for its values.
TEST_F(ServiceTest, ARemovedDeviceIsAnsweredWithDeviceFailure) {
  EXPECT_THAT(Ask(1, "03 00 00 00 01"), ElementsAre("12 34 00 00 00 05 01 03 02 FF FE"));
  store_->Retire(0);
  store_->Forget(0);
  EXPECT_THAT(Ask(1, "03 00 00 00 01"), ElementsAre("12 34 00 00 00 03 01 83 04"));
  EXPECT_THAT(Ask(1, "06 00 00 00 07"), ElementsAre("12 34 00 00 00 03 01 86 04"));
  EXPECT_THAT(sink_.commands, IsEmpty());
}

TEST_F(ServiceTest, ClientsAreLimitedToPermittedFunctions) {
  Add(1, 20, 20);
  drive_.answer = [](const bus::RoutedRequest& request) { return GoodReply(request.pdu); };
  const auto allowed = [this](config::Permit permit) {
    listener().permit = permit;
    std::string codes;
    for (int code = 1; code < 0x80; ++code) {
      const std::string hex = HexByte(static_cast<std::uint8_t>(code));
      const Answers answers = Ask(20, hex + " 00");
      const std::string refused = HexByte(static_cast<std::uint8_t>(code | 0x80));
      if (answers != Answers{"12 34 00 00 00 03 14 " + refused + " 01"}) codes += hex + " ";
    }
    return codes;
  };
  EXPECT_EQ(allowed(config::Permit::read), "01 02 03 04 ");
  EXPECT_EQ(allowed(config::Permit::data), "01 02 03 04 05 06 0F 10 ");
  EXPECT_EQ(allowed(config::Permit::all).size(), 127U * 3);
  listener().permit = config::Permit::read;
  EXPECT_THAT(Ask(20, "06 00 08 00 02"), ElementsAre("12 34 00 00 00 03 14 86 01"));
  EXPECT_THAT(Ask(1, "06 00 00 00 02"), ElementsAre("12 34 00 00 00 03 01 86 01"));
  EXPECT_THAT(Ask(99, "06 00 00 00 02"), ElementsAre("12 34 00 00 00 03 63 86 0A"));
}

TEST_F(ServiceTest, ThePriorityOfAFunctionOverridesThatOfTheClient) {
  using config::Priority;
  Add(1, 20, 20);
  listener().functions = {{{5, 6}, Priority::high}, {{6, 16}, Priority::low}};
  Enter(wire_, Priority::low);
  Ask(20, "06 00 08 00 02");
  Ask(20, "10 00 08 00 01 02 00 02");
  Ask(20, kRead);
  EXPECT_EQ(drive_.Wait(0).priority, Priority::high) << "the first rule that fits";
  EXPECT_EQ(drive_.Wait(1).priority, Priority::low);
  EXPECT_EQ(drive_.Wait(2).priority, Priority::low);
  KeptWire other;
  Enter(other, Priority::high)->Handle(Frame(20, kRead), Clocks());
  EXPECT_EQ(drive_.Wait(3).priority, Priority::high);
}

TEST_F(ServiceTest, AnUnansweredRequestGetsAnExceptionSoonAfterItsDeadline) {
  Add(1, 20, 20).deadline = 2500ms;
  Ask(20, kRead);
  EXPECT_EQ(services_[0]->Deadline(), now_ + 2520ms);
  EXPECT_THAT(wire_.sweeps, ElementsAre(now_ + 2520ms));
  now_ += 2519ms;
  services_[0]->Sweep(Clocks());
  EXPECT_THAT(Settle(), IsEmpty()) << "the target's own answer still has its chance";
  now_ += 1ms;
  services_[0]->Sweep(Clocks());
  EXPECT_EQ(services_[0]->Deadline(), std::nullopt);
  EXPECT_THAT(Settle(), ElementsAre("12 34 00 00 00 03 14 83 0B"));
  drive_.Wait(0).done(GoodReply("03 02 00 07"));
  EXPECT_THAT(Settle(), IsEmpty()) << "answered once";
  EXPECT_EQ(Traffic().routes[0].no_reply, 1U);
  EXPECT_EQ(Traffic().routes[0].ok, 0U);
}

TEST_F(ServiceTest, AWriteConfirmedAtItsDeadlineIsAnsweredAsConfirmed) {
  EXPECT_THAT(Ask(1, "06 00 00 00 07"), IsEmpty());
  const bus::WriteCommand write = sink_.commands.at(0);
  now_ = write.deadline;
  services_[0]->Sweep(Clocks());
  EXPECT_THAT(Settle(), IsEmpty()) << "the line's own answer still has its chance";
  write.done({});
  EXPECT_THAT(Settle(), ElementsAre("12 34 00 00 00 06 01 06 00 00 00 07"));
  Ask(1, "06 00 00 00 07");
  now_ = sink_.commands.at(1).deadline + PendingRequest::kGrace;
  services_[0]->Sweep(Clocks());
  EXPECT_THAT(Settle(), ElementsAre("12 34 00 00 00 03 01 86 0B"));
}

TEST_F(ServiceTest, WritesOfALeavingOrCancellingClientAreDropped) {
  Ask(1, "06 00 00 00 01");
  Ask(1, "06 00 00 00 02");
  services_[0]->Abandon();
  Ask(1, "06 00 00 00 03");
  const auto abandoned = [this](std::size_t i) { return sink_.commands.at(i).abandoned->load(); };
  EXPECT_TRUE(abandoned(0));
  EXPECT_TRUE(abandoned(1));
  EXPECT_FALSE(abandoned(2));
  services_[0]->Close();
  EXPECT_TRUE(abandoned(2));
}

TEST_F(ServiceTest, TheSoonestDeadlineIsSweptFirst) {
  Add(1, 20, 20).deadline = 1h;
  Add(2, 30, 30).deadline = 30min;
  Ask(20, kRead);
  Ask(30, kRead);
  now_ = services_[0]->Deadline().value();
  services_[0]->Sweep(Clocks());
  EXPECT_THAT(wire_.Take(), ElementsAre("12 34 00 00 00 03 1E 83 0B"));
  EXPECT_EQ(services_[0]->outstanding(), 1U);
}

TEST_F(ServiceTest, AReplyAfterTheDeadlineCountsAsNoReply) {
  Add(1, 20, 20).deadline = 1h;
  for (const bus::RoutedReply& late : {GoodReply("03 02 00 07"), SlaveException("83 02")}) {
    Ask(20, kRead);
    now_ += 1h;
    drive_.Wait(drive_.count() - 1).done(late);
    EXPECT_THAT(Settle(), ElementsAre("12 34 00 00 00 03 14 83 0B"));
  }
  EXPECT_EQ(Traffic().routes[0].no_reply, 2U);
  EXPECT_EQ(Traffic().routes[0].last_trouble, "the reply came after the deadline of the request");
}

TEST_F(ServiceTest, AnAbandonedRequestIsNotAnswered) {
  Add(1, 20, 20);
  Ask(20, kRead);
  Ask(1, "06 00 00 00 07");
  services_[0]->Abandon();
  EXPECT_THAT(drive_.forgotten(), ElementsAre(IdOf(0)));
  drive_.Wait(0).done(GoodReply("03 02 00 07"));
  sink_.commands.at(0).done({});
  EXPECT_THAT(Settle(), IsEmpty());
  EXPECT_EQ(services_[0]->outstanding(), 0U);
  services_[0]->Abandon();
  EXPECT_THAT(drive_.forgotten(), testing::SizeIs(1)) << "nothing is left to forget";
}

TEST_F(ServiceTest, ALeavingClientIsForgottenByEveryTargetItUsed) {
  Add(1, 20, 20);
  Add(2, 30, 30);
  Ask(20, kRead);
  Ask(20, kRead);
  const std::uint64_t id = IdOf(0);
  services_[0]->Close();
  EXPECT_THAT(drive_.forgotten(), ElementsAre(id));
  EXPECT_THAT(pumps_.forgotten(), IsEmpty());
  drive_.Wait(0).done(GoodReply("03 02 00 07"));
  EXPECT_THAT(Settle(), IsEmpty());
  EXPECT_EQ(Traffic().routes[0].dropped, 2U);
  EXPECT_THAT(Traffic().clients, IsEmpty());
}

TEST_F(ServiceTest, RepliesAfterTheEndOfTheServiceAreIgnored) {
  Add(1, 20, 20);
  Ask(20, kRead);
  const bus::RoutedRequest request = drive_.Wait(0);
  services_[0]->Close();
  services_.clear();
  shared_->inbox()->Close();
  shared_.reset();
  request.done(GoodReply("03 02 00 07"));
  EXPECT_THAT(Settle(), IsEmpty());
}

TEST(Permission, PermitsFunctionCodes) {
  const auto allowed = [](config::Permit permit) {
    std::string codes;
    for (int code = 0; code < 256; ++code) {
      if (Permits(permit, static_cast<std::uint8_t>(code))) codes += std::to_string(code) + " ";
    }
    return codes;
  };
  EXPECT_EQ(allowed(config::Permit::read), "1 2 3 4 ");
  EXPECT_EQ(allowed(config::Permit::data), "1 2 3 4 5 6 15 16 ");
  EXPECT_TRUE(Permits(config::Permit::all, 100));
}

constexpr const char* kStopAll = "06 00 08 00 00";
constexpr const char* kReadStatus = "03 23 28 00 01";
constexpr const char* kStatus = "12 34 00 00 00 05 00 03 02 00 00";
constexpr const char* kNotHere = "12 34 00 00 00 03 00 86 02";

class BroadcastTest : public ServiceTest {
 protected:
  void Pass() { listener().broadcast = config::Listener::Broadcast::pass; }
};

TEST_F(BroadcastTest, UnitZeroIsTheGatewayByDefault) {
  Add(1, 20, 20);
  EXPECT_THAT(Ask(0, kStopAll), ElementsAre(kNotHere));
  EXPECT_THAT(Ask(0, kReadStatus), ElementsAre(kStatus));
  EXPECT_EQ(drive_.count(), 0U);
}

TEST_F(BroadcastTest, AForwardedBroadcastReachesEveryRoutedLineOnceUnanswered) {
  Pass();
  Add(1, 20, 20).deadline = 700ms;
  Add(2, 30, 30);
  Add(1, 21, 21).deadline = 900ms;
  EXPECT_THAT(Ask(0, kStopAll), ElementsAre("nothing"));
  ASSERT_EQ(drive_.count(), 1U);
  ASSERT_EQ(pumps_.count(), 1U);
  const bus::RoutedRequest request = drive_.Wait(0);
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

TEST_F(BroadcastTest, BroadcastsNeedPermission) {
  Pass();
  listener().permit = config::Permit::read;
  Add(1, 20, 20);
  EXPECT_THAT(Ask(0, kStopAll), ElementsAre("12 34 00 00 00 03 00 86 01"));
  EXPECT_EQ(drive_.count(), 0U);
}

TEST_F(BroadcastTest, ARouteOfUnitZeroSendsABroadcastToItsOwnLineOnly) {
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

TEST_F(BroadcastTest, ARouteThatRemapsUnitZeroSendsAnOrdinaryRequest) {
  Add(1, 0, 0).remap = 7;
  Ask(0, kStopAll);
  EXPECT_EQ(drive_.Wait(0).slave, 7);
  drive_.Wait(0).done(GoodReply(std::string(kStopAll)));
  EXPECT_THAT(Settle(), ElementsAre("12 34 00 00 00 06 00 06 00 08 00 00"));
  Ask(0, kReadStatus);
  EXPECT_EQ(ToHex(drive_.Wait(1).pdu), kReadStatus);
}

TEST_F(BroadcastTest, AnRtuMasterGetsNoReplyToAWriteToARemappedUnitZero) {
  listener().framing = Framing::rtu;
  Add(1, 0, 0).remap = 7;
  for (const bus::RoutedReply& reply : {GoodReply(std::string(kStopAll)), SlaveException("86 02"),
                                        Trouble(Outcome::no_reply, "")}) {
    EXPECT_THAT(Ask(0, kStopAll), IsEmpty());
    drive_.Wait(drive_.count() - 1).done(reply);
    EXPECT_THAT(Settle(), ElementsAre("nothing"));
  }
  Ask(0, kReadStatus);
  drive_.Wait(3).done(GoodReply("03 02 00 07"));
  EXPECT_THAT(Settle(), ElementsAre("12 34 00 00 00 05 00 03 02 00 07"));
}

TEST_F(BroadcastTest, ABroadcastingClientMayLeaveAtOnce) {
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

TEST_F(BroadcastTest, AClientMayNotFillTheQueuesWithBroadcasts) {
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

TEST_F(BroadcastTest, AnRtuMasterGetsNoReplyToABroadcast) {
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
