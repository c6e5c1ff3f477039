// What a routed write is called, and that each leaves one record whatever becomes of it.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "gateway/records/audit/audited_writes.h"
#include "tests/gateway/records/audit/fixture.h"
#include "tests/gateway/records/audit/remembering_log.h"

namespace baudgate::audit {
namespace {

using ::testing::HasSubstr;

RoutedWrite Write(View pdu) { return {"10.0.0.7:1", "drive", 20, false, pdu, {kStart, kWall}}; }

std::string Said(const Bytes& pdu) {
  const WriteRecord record = RecordOf(Write(pdu));
  return record.point + " = " + ToText(record.value);
}

TEST(RoutedRecord, SaysFunctionAddressAndValues) {
  EXPECT_EQ(Said({5, 0, 3, 0xFF, 0}), "05 coil 3 = 1");
  EXPECT_EQ(Said({5, 0, 3, 0, 0}), "05 coil 3 = 0");
  EXPECT_EQ(Said({6, 0, 100, 1, 2}), "06 holding 100 = 258");
  EXPECT_EQ(Said({16, 0, 100, 0, 2, 4, 0, 1, 0, 2}), "16 holding 100-101 = 1 2");
  EXPECT_EQ(Said({16, 0, 100, 0, 1, 2, 0, 9}), "16 holding 100 = 9");
  EXPECT_EQ(Said({15, 0, 8, 0, 3, 1, 0x05}), "15 coil 8-10 = 1 0 1");
  EXPECT_EQ(Said({22, 0, 4, 0, 0xF2, 0, 0x25}), "22 holding 4 = and 242 or 37");
  EXPECT_EQ(Said({23, 0, 3, 0, 6, 0, 14, 0, 1, 2, 0, 255}), "23 holding 14 = 255");
  EXPECT_EQ(Said({66, 1, 2, 3}), "66 = ");
  const WriteRecord record = RecordOf(Write(Bytes{6, 0, 1, 0, 0}));
  EXPECT_EQ(record.line + ", " + record.device, "drive, unit 20");
}

TEST(RoutedRecord, DamagedRequestsHaveNoValues) {
  EXPECT_EQ(Said({16, 0, 100, 0, 2, 4, 0, 1}), "16 = ");
  EXPECT_EQ(Said({23, 0, 3, 0, 6, 0, 14, 0, 200, 2, 0, 255}), "23 = ");
  EXPECT_EQ(Said({22, 0}), "22 = ");
  EXPECT_EQ(Said({6}), "06 = ");
}

TEST(RoutedRecord, OfManyValuesSixteenAreTold) {
  Bytes pdu = {16, 0, 0, 0, 100, 200};
  pdu.resize(206, 0);
  EXPECT_THAT(Said(pdu), HasSubstr("0 0 0 … (100)"));
}

class WitnessTest : public ::testing::Test {
 protected:
  const WriteRecord& After(const RoutedReply& reply, bool broadcast = false) {
    const Bytes pdu = {6, 0, 1, 0, 2};
    RoutedWrite write = Write(pdu);
    write.broadcast = broadcast;
    Witness::Watch(std::make_shared<Witness>(log_, write), [](RoutedReply) {})(reply);
    return log_.noted.back();
  }
  static RoutedReply Reply(Outcome outcome, bool sent, Bytes pdu = {}) {
    RoutedReply reply;
    reply.outcome = outcome;
    reply.sent = sent;
    reply.pdu = std::move(pdu);
    reply.reason = "silence";
    return reply;
  }
  RememberingLog log_;
};

TEST_F(WitnessTest, TellsWhatIsKnown) {
  EXPECT_EQ(After(Reply(Outcome::ok, true, {6, 0, 1, 0, 2})).end, WriteEnd::ok);
  EXPECT_EQ(After(Reply(Outcome::refused, true, {0x86, 2})).end, WriteEnd::refused);
  EXPECT_THAT(log_.noted.back().reason, HasSubstr("exception 02"));
  EXPECT_EQ(After(Reply(Outcome::no_reply, true)).end, WriteEnd::unknown);
  EXPECT_EQ(log_.noted.back().reason, "silence");
  EXPECT_EQ(After(Reply(Outcome::no_reply, false)).end, WriteEnd::not_sent);
  EXPECT_EQ(After(Reply(Outcome::ok, true), true).end, WriteEnd::unknown)
      << "nobody answers a broadcast";
}

TEST_F(WitnessTest, ADroppedRequestLeavesARecordAndNoSuccess) {
  const Bytes pdu = {6, 0, 1, 0, 2};
  { const auto done = Witness::Watch(std::make_shared<Witness>(log_, Write(pdu)), {}); }
  ASSERT_EQ(log_.noted.size(), 1U);
  EXPECT_EQ(log_.noted[0].end, WriteEnd::unknown);
}

TEST_F(WitnessTest, WhatIsNotLetInIsOneRecord) {
  const Bytes pdu = {6, 0, 1, 0, 2};
  {
    const auto witness = std::make_shared<Witness>(log_, Write(pdu));
    const auto done = Witness::Watch(witness, {});
    witness->Deny(WriteEnd::busy, "full");
  }
  ASSERT_EQ(log_.noted.size(), 1U);
  EXPECT_EQ(log_.noted[0].end, WriteEnd::busy);
  EXPECT_EQ(log_.noted[0].kind, Kind::denied);
}

}  // namespace
}  // namespace baudgate::audit
