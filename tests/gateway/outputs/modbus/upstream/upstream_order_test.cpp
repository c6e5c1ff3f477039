// Which requests to a Modbus TCP server go out, and which wait: places on the wire, priorities,
// writes.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/gateway/outputs/modbus/upstream/upstream_fixture.h"

namespace baudgate::modbus {
namespace {

using test::RunReady;
using testing::HasSubstr;

TEST_F(UpstreamTest, TheWireTakesTwelveReadsAndThenThePriorityDecides) {
  FillTheWire();
  Submit({.slave = 30, .pdu = "03 00 0A 00 01", .priority = config::Priority::low});
  Submit({.slave = 30, .pdu = "03 00 0B 00 01"});
  Submit({.slave = 30, .pdu = "03 00 0C 00 01", .priority = config::Priority::high});
  RunReady(io_);
  ASSERT_EQ(server_.Requests().size(), 12U);
  std::size_t sent = 12;
  for (const std::string id : {"04", "05", "06"}) {
    server_.Write("00 " + id + " 00 00 00 05 15 03 02 00 01");
    ASSERT_TRUE(server_.Wait(++sent));
  }
  const auto requests = server_.Requests();
  EXPECT_THAT(requests[12], HasSubstr("03 00 0C"));
  EXPECT_THAT(requests[13], HasSubstr("03 00 0B"));
  EXPECT_THAT(requests[14], HasSubstr("03 00 0A"));
}

TEST_F(UpstreamTest, ShortWritesDoNotWaitForReadsThatNobodyAnswers) {
  FillTheWire();
  for (std::uint8_t unit = 40; unit < 48; ++unit) Submit({.slave = unit});
  RunReady(io_);
  Submit({.slave = 20, .pdu = "06 00 08 00 00"});
  Submit({.slave = 30, .pdu = "06 00 08 00 00"});
  ASSERT_TRUE(server_.Wait(kReadsOnWire + 2));
  EXPECT_EQ(server_.Requests()[12], "00 0C 00 00 00 06 14 06 00 08 00 00");
  EXPECT_EQ(server_.Requests()[13], "00 0D 00 00 00 06 1E 06 00 08 00 00");
}

TEST_F(UpstreamTest, OneUnitTakesFourPlacesAndASilentOneOne) {
  const auto read = [this](std::uint8_t unit, int start, Duration within = 1h) {
    Submit({.slave = unit,
            .pdu = "03 01 " + HexByte(static_cast<std::uint8_t>(start)) + " 00 01",
            .within = within});
  };
  for (int i = 0; i < 6; ++i) read(20, i, 300ms);
  read(21, 0);
  ASSERT_TRUE(server_.Wait(5));
  EXPECT_THAT(server_.Requests()[4], HasSubstr(" 15 03 01 00")) << "others do not wait";
  server_.Write("00 04 00 00 00 05 15 03 02 00 01");
  for (std::size_t i = 0; i < 7; ++i) Wait(asked_[i]);
  ASSERT_TRUE(asked_[3].reply.sent) << "the machine stood still for 300 ms";
  std::size_t sent = server_.Requests().size();
  for (int i = 0; i < 6; ++i) read(20, 10 + i);
  read(21, 1);
  ASSERT_TRUE(server_.Wait(sent + 2));
  RunReady(io_);
  ASSERT_EQ(server_.Requests().size(), sent + 2);
  const std::string id = server_.Requests()[sent].substr(0, 5);
  server_.Write(id + " 00 00 00 05 14 03 02 00 01");
  ASSERT_TRUE(server_.Wait(sent + 2 + RequestsOnWire::kMostPerUnit)) << "it answers again";
}

TEST_F(UpstreamTest, TheNextWriteToAUnitWaitsForTheOneBefore) {
  const Asked& start = Submit({.pdu = "06 00 08 00 02", .client = 1});
  Submit({.pdu = "06 00 08 00 00", .client = 2, .priority = config::Priority::high});
  Submit({.slave = 21, .pdu = "06 00 08 00 07", .client = 2});
  ASSERT_TRUE(server_.Wait(2));
  RunReady(io_);
  ASSERT_EQ(server_.Requests().size(), 2U);
  EXPECT_EQ(server_.Requests()[0], "00 00 00 00 00 06 14 06 00 08 00 02");
  EXPECT_EQ(server_.Requests()[1], "00 01 00 00 00 06 15 06 00 08 00 07");
  server_.Write("00 00 00 00 00 06 14 06 00 08 00 02");
  EXPECT_EQ(Wait(start).outcome, Outcome::ok);
  ASSERT_TRUE(server_.Wait(3));
  EXPECT_EQ(server_.Requests()[2], "00 02 00 00 00 06 14 06 00 08 00 00");
}

}  // namespace
}  // namespace baudgate::modbus
