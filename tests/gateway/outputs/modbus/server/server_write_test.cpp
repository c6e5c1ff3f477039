// Writes: what the sink is given, and how each end of a command is answered.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "tests/gateway/outputs/modbus/server/server_fixture.h"

namespace baudgate::modbus {
namespace {

TEST_F(ServerTest, ConfirmedWritesAreEchoed) {
  sink_.answer = WriteEnd::ok;
  StartServer();
  const RawClient client = Connect();
  EXPECT_EQ(Ask(client, 1, "06 00 00 00 2A"), "06 00 00 00 2A");
  EXPECT_EQ(Ask(client, 1, "10 00 01 00 02 04 47 F1 20 00"), "10 00 01 00 02");
  EXPECT_EQ(Ask(client, 1, "05 00 00 FF 00"), "05 00 00 FF 00");
  EXPECT_EQ(Ask(client, 1, "05 00 00 00 00"), "05 00 00 00 00");
  EXPECT_EQ(Ask(client, 1, "0F 00 00 00 01 01 01"), "0F 00 00 00 01");
  const WriteCommand command = sink_.Wait(1);
  EXPECT_EQ(command.device, 0U);
  ASSERT_EQ(command.writes().size(), 1U);
  EXPECT_EQ(command.writes()[0].point, 1U);
  EXPECT_EQ(command.writes()[0].raw, Value(123456.0));
  EXPECT_EQ(Ask(client, 1, "03 00 00 00 01"), "03 02 FF FE") << "only a reading changes the store";
}

struct WriteEnding {
  WriteEnd end;
  const char* answer;
  bool unfit = false;
};

class WriteEndings : public ServerTest, public testing::WithParamInterface<WriteEnding> {};

TEST_P(WriteEndings, AreAnsweredAsTheContractSays) {
  sink_.answer = GetParam().end;
  sink_.unfit = GetParam().unfit;
  StartServer();
  EXPECT_EQ(Ask(Connect(), 1, "06 00 00 00 01"), GetParam().answer);
}

INSTANTIATE_TEST_SUITE_P(
    All, WriteEndings,
    testing::Values(WriteEnding{WriteEnd::refused, "86 04"},
                    WriteEnding{WriteEnd::refused, "86 03", true},
                    WriteEnding{WriteEnd::differs, "86 04"}, WriteEnding{WriteEnd::denied, "86 04"},
                    WriteEnding{WriteEnd::busy, "86 06"}, WriteEnding{WriteEnd::unknown, "86 0B"},
                    WriteEnding{WriteEnd::not_sent, "86 0B"}),
    [](const auto& info) {
      return std::string(Name(info.param.end)) + (info.param.unfit ? "_unfit" : "");
    });

TEST_F(ServerTest, AFullQueueIsBusy) {
  sink_.full = true;
  StartServer();
  EXPECT_EQ(Ask(Connect(), 1, "06 00 00 00 01"), "86 06");
}

TEST_F(ServerTest, RefusedWritesNeverReachTheSink) {
  sink_.answer = WriteEnd::ok;
  StartServer();
  const RawClient client = Connect();
  EXPECT_EQ(Ask(client, 1, "06 00 03 00 01"), "86 02");
  EXPECT_EQ(Ask(client, 1, "06 00 01 00 01"), "86 03");
  EXPECT_EQ(Ask(client, 1, "05 00 01 FF 00"), "85 02");
  EXPECT_EQ(Ask(client, 1, "10 00 00 00 02 04 00 00"), "90 03") << "data cut short";
  EXPECT_EQ(Ask(client, 1, "06 00 00 00 05"), "06 00 00 00 05");
  EXPECT_EQ(sink_.Wait(0).writes()[0].raw, Value(std::int64_t{5})) << "the first to arrive";
}

TEST_F(ServerTest, LaterRequestsDoNotWaitForAWrite) {
  StartServer();
  const RawClient client = Connect();
  client.Send(Frame(1, "06 00 00 00 01", 1));
  client.Send(Frame(1, "03 00 00 00 01", 2));
  EXPECT_EQ(ToHex(client.ReceiveFrame()), "00 02 00 00 00 05 01 03 02 FF FE");
  sink_.Wait(0).done({});
  EXPECT_EQ(ToHex(client.ReceiveFrame()), "00 01 00 00 00 06 01 06 00 00 00 01");
}

TEST_F(ServerTest, AWriteIsAnsweredAtItsDeadlineAndOnlyOnce) {
  StartServer({.write_deadline = 20ms, .stall = 10s});
  const RawClient client = Connect();
  const Instant before = ReadClocks().instant;
  EXPECT_EQ(Ask(client, 1, "06 00 00 00 01"), "86 0B");
  EXPECT_GE(ReadClocks().instant, before + 20ms);
  const WriteCommand command = sink_.Wait(0);
  EXPECT_GE(command.deadline, before + 20ms);
  command.done({});
  EXPECT_EQ(Ask(client, 1, "03 00 00 00 01"), "03 02 FF FE") << "no late answer in between";
}

TEST_F(ServerTest, OneClientMayNotFillTheQueue) {
  StartServer();
  const RawClient client = Connect();
  for (std::uint16_t i = 0; i < 33; ++i) client.Send(Frame(1, "06 00 00 00 01", i));
  EXPECT_EQ(ToHex(client.ReceiveFrame()), "00 20 00 00 00 03 01 86 06");
}

TEST_F(ServerTest, TheClientMayBeGoneWhenTheDeviceConfirms) {
  listener().max_clients = 1;
  StartServer();
  RawClient client = Connect();
  client.Send(Frame(1, "06 00 00 00 01"));
  const WriteCommand command = sink_.Wait(0);
  client.Send(ParseHex("00 01 12 34").value());
  ASSERT_TRUE(client.IsClosed());
  command.done({});
  EXPECT_EQ(Ask(Connect(), 1, "03 00 00 00 01"), "03 02 FF FE");
}

TEST_F(ServerTest, TheServerMayBeGoneWhenTheDeviceConfirms) {
  StartServer();
  const RawClient client = Connect();
  client.Send(Frame(1, "06 00 00 00 01"));
  const WriteCommand command = sink_.Wait(0);
  StopServer();
  command.done({});
  EXPECT_TRUE(client.IsClosed());
}

}  // namespace
}  // namespace baudgate::modbus
