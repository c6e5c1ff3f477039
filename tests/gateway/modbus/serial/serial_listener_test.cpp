// What a serial master is answered, and what not.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "tests/gateway/modbus/serial/serial_listener_fixture.h"

namespace baudgate::modbus {
namespace {

TEST_F(SerialListenerTest, ReadsComeFromTheStore) {
  Begin();
  AskForTheValue();
  AskForTheValue();
  EXPECT_EQ(Damaged(), 0U);
}

TEST_F(SerialListenerTest, AWriteIsAnsweredWhenTheDeviceHasConfirmedIt) {
  Begin();
  Say(1, "06 00 00 00 07");
  ASSERT_TRUE(Commanded(1));
  ExpectSilence();
  sink_.commands[0].done(Outcome::ok, "");
  Expect(1, "06 00 00 00 07");
}

TEST_F(SerialListenerTest, ExceptionsOfTheUnitAreAnswered) {
  Begin();
  Say(1, "03 10 00 00 01");
  Expect(1, "83 02");
  Say(1, "06 00 00 00 07");
  ASSERT_TRUE(Commanded(1));
  sink_.commands[0].done(Outcome::refused, "no");
  Expect(1, "86 04");
}

TEST_F(SerialListenerTest, RoutedRequestsPassAsTheyAre) {
  Begin();
  Say(20, "03 00 C8 00 01");
  ASSERT_TRUE(Asked(1));
  EXPECT_EQ(target_.requests[0].slave, 20);
  EXPECT_EQ(ToHex(target_.requests[0].pdu), "03 00 C8 00 01");
  target_.Answer(0, "03 02 09 C4");
  Expect(20, "03 02 09 C4");
}

TEST_F(SerialListenerTest, ARequestMayComeInAnyPieces) {
  listener().serial.baud = 300;  // so that no piece is too late on a slow machine
  Begin();
  const Bytes request = Rtu(1, "03 00 00 00 01");
  for (std::size_t cut = 1; cut < request.size(); ++cut) {
    master_->Write(Bytes(request.begin(), request.begin() + static_cast<std::ptrdiff_t>(cut)));
    RunReady(io_);
    master_->Write(Bytes(request.begin() + static_cast<std::ptrdiff_t>(cut), request.end()));
    Expect(1, "03 02 FF FE");
  }
  for (const std::uint8_t byte : request) {
    master_->Write({byte});
    RunReady(io_);
  }
  Expect(1, "03 02 FF FE");
}

TEST_F(SerialListenerTest, AfterGarbageAndASilenceTheNextRequestIsAnswered) {
  Begin();
  Bytes bytes = ParseHex("FF 00 13 37 01 03 00").value();
  Append(bytes, View(Rtu(1, "06 00 00 00 07")));
  master_->Write(bytes);
  ASSERT_TRUE(RunUntil(io_, [&] { return Damaged() == 1; }));
  EXPECT_TRUE(sink_.commands.empty()) << "it may be another's data";
  AskForTheValue();
  EXPECT_EQ(Damaged(), 1U);
}

TEST_F(SerialListenerTest, DriverNoiseBeforeARequestIsPassedOver) {
  Begin();
  Bytes bytes = ParseHex("FF 00").value();
  Append(bytes, View(Rtu(1, "03 00 00 00 01")));
  master_->Write(bytes);
  Expect(1, "03 02 FF FE");
  EXPECT_EQ(Damaged(), 0U);
}

TEST_F(SerialListenerTest, DamageIsCountedAndNotAnswered) {
  Begin();
  Bytes request = Rtu(1, "03 00 00 00 01");
  request[3] ^= 0x01;
  master_->Write(request);
  ASSERT_TRUE(RunUntil(io_, [&] { return Damaged() == 1; }));
  ExpectSilence();
  request = Rtu(1, "06 00 00 00 07");
  request.pop_back();
  master_->Write(request);
  ASSERT_TRUE(RunUntil(io_, [&] { return Damaged() == 2; }));
  EXPECT_TRUE(sink_.commands.empty());
  AskForTheValue();
}

TEST_F(SerialListenerTest, OthersOnTheBusAreNotDisturbed) {
  Begin();
  const std::pair<std::string, std::string> exchanges[] = {
      {"03 00 C8 00 01", "03 02 09 C4"},    {"03 00 C8 00 02", "03 04 09 C4 00 CA"},
      {"06 00 08 00 02", "06 00 08 00 02"}, {"10 00 01 00 01 02 00 05", "10 00 01 00 01"},
      {"03 10 00 00 01", "83 02"},
  };
  for (const auto& [request, reply] : exchanges) {
    Bytes bytes = Rtu(5, request);
    Append(bytes, View(Rtu(5, reply)));
    Append(bytes, View(Rtu(1, "03 00 00 00 01")));
    master_->Write(bytes);
    Expect(1, "03 02 FF FE");
  }
  EXPECT_EQ(Damaged(), 0U);
  EXPECT_TRUE(sink_.commands.empty());
}

TEST_F(SerialListenerTest, UnitsThatAreNotMappedStaySilent) {
  Begin();
  Say(77, "03 00 00 00 01");
  ExpectSilence();
  AskForTheValue();
}

TEST_F(SerialListenerTest, NobodyAnswersABroadcast) {
  listener().broadcast = config::Listener::Broadcast::pass;
  Begin();
  Say(0, "06 00 08 00 00");
  ASSERT_TRUE(Asked(1));
  EXPECT_EQ(target_.requests[0].slave, 0);
  target_.Answer(0, "06 00 08 00 00");
  ExpectSilence();
  Say(0, "03 23 28 00 01");
  ExpectSilence();
  EXPECT_EQ(points_->book()->Status(ReadClocks()).clients[0].bytes_out, 0U);
  AskForTheValue();
}

TEST_F(SerialListenerTest, AMasterThatAsksAnewHasGivenUp) {
  Begin();
  Say(20, "03 00 C8 00 01");
  ASSERT_TRUE(Asked(1));
  Say(20, "03 00 C8 00 01");
  ASSERT_TRUE(Asked(2));
  target_.Answer(0, "03 02 AA AA");
  ExpectSilence();
  target_.Answer(1, "03 02 BB BB");
  Expect(20, "03 02 BB BB");
  AskForTheValue();
}

TEST_F(SerialListenerTest, AMasterThatAsksAnotherSlaveHasGivenUp) {
  Begin();
  Say(20, "03 00 C8 00 01");
  ASSERT_TRUE(Asked(1));
  Say(5, "03 00 C8 00 01");
  ASSERT_TRUE(RunUntil(io_, [&] { return Master().frames == 2; }));
  target_.Answer(0, "03 02 AA AA");
  ExpectSilence();
}

TEST_F(SerialListenerTest, BytesBehindARequestAreHeardOutBeforeTheReply) {
  Begin();
  Bytes bytes = Rtu(1, "03 00 00 00 01");
  bytes.push_back(0x00);
  bytes.push_back(0x03);
  master_->Write(bytes);
  Expect(1, "03 02 FF FE");
  EXPECT_EQ(Damaged(), 1U) << "it was sent into what might have become a request";
}

TEST_F(SerialListenerTest, AReplyKeepsTheQuietOfTheBus) {
  listener().serial.baud = 300;
  Begin();
  const Instant asked = std::chrono::steady_clock::now();
  AskForTheValue();
  // Longer on a slow machine, never shorter: 3.5 characters of 11 bits.
  EXPECT_GE(std::chrono::steady_clock::now() - asked, 128ms);
}

TEST_F(SerialListenerTest, TheMasterIsAClientLikeOthers) {
  Begin();
  AskForTheValue();
  const TrafficStatus traffic = points_->book()->Status(ReadClocks());
  ASSERT_EQ(traffic.clients.size(), 1U);
  EXPECT_EQ(traffic.clients[0].peer, listener().path);
  EXPECT_EQ(traffic.clients[0].requests, 1U);
  EXPECT_EQ(traffic.clients[0].bytes_in, 8U);
  EXPECT_EQ(traffic.clients[0].bytes_out, 7U);
}

TEST_F(SerialListenerTest, RequestsToOthersAreNotCountedAsItsOwn) {
  Begin();
  for (int i = 0; i < 5; ++i) Say(5, "03 00 C8 00 01");
  AskForTheValue();
  EXPECT_EQ(Master().frames, 6U);
  EXPECT_EQ(points_->book()->Status(ReadClocks()).clients[0].requests, 1U);
}

TEST_F(SerialListenerTest, AnAbsentPortIsOpenedWhenItAppearsAndAgainWhenItReturns) {
  Open();
  ASSERT_TRUE(RunUntil(io_, [&] { return Master().text != "not opened yet"; }));
  EXPECT_FALSE(serial_->is_open());
  EXPECT_FALSE(Master().is_open);
  for (int i = 0; i < 2; ++i) {
    PlugIn();
    ASSERT_TRUE(RunUntil(io_, [&] { return serial_->is_open(); }));
    heard_ = 0;
    EXPECT_TRUE(Master().is_open);
    EXPECT_EQ(Master().frames, static_cast<std::uint64_t>(i));
    AskForTheValue();
    EXPECT_EQ(Master().frames, static_cast<std::uint64_t>(i) + 1);
    EXPECT_NE(Master().last_frame, WallTime{});
    Unplug();
    ASSERT_TRUE(RunUntil(io_, [&] { return !serial_->is_open(); }));
    EXPECT_FALSE(Master().is_open);
    EXPECT_TRUE(points_->book()->Status(ReadClocks()).clients.empty());
  }
}

TEST_F(SerialListenerTest, WhatIsAnsweredAfterTheEndIsDropped) {
  Begin();
  Say(20, "03 00 C8 00 01");
  ASSERT_TRUE(Asked(1));
  Unplug();
  ASSERT_TRUE(RunUntil(io_, [&] { return !serial_->is_open(); }));
  EXPECT_EQ(target_.forgotten, 1);
  target_.Answer(0, "03 02 09 C4");
  serial_->Stop();
  serial_.reset();
  RunReady(io_);
}

}  // namespace
}  // namespace baudgate::modbus
