// Tests of the serial port at which a master asks: the port opens, is lost, and is found again.
// SPDX-License-Identifier: Apache-2.0
#include <thread>

#include "tests/gateway/outputs/modbus/serial/serial_listener_fixture.h"

namespace baudgate::modbus {
namespace {

using test::RunReady;
using test::RunUntil;

TEST_F(SerialListenerTest, AMasterIsAnswered) {
  Begin();
  AskForTheValue();
  Say(20, "03 00 C8 00 01");
  ASSERT_TRUE(RunUntil(io_, [&] { return target_.requests.size() == 1; }));
  target_.Answer(0, "03 02 09 C4");
  Expect(20, "03 02 09 C4");
}

TEST_F(SerialListenerTest, ADeadlineIsAnsweredWithoutASweep) {
  listener().errors = config::Listener::Errors::exception;
  config_.modbus.routes[0].deadline = 10ms;
  Begin();
  Say(20, "03 00 C8 00 01");
  Expect(20, "83 0B");
}

TEST_F(SerialListenerTest, AReplyWaitsForTheSilenceOfTheBus) {
  listener().serial.baud = 300;
  Begin();
  const Instant asked = ReadClocks().instant;
  AskForTheValue();
  // After the request, the line must be silent for 3.5 characters of 11 bits. A slow machine can
  // take longer.
  EXPECT_GE(ReadClocks().instant - asked, 128ms);
}

TEST_F(SerialListenerTest, AnAbsentPortIsOpenedEachTimeItAppears) {
  Open();
  ASSERT_TRUE(RunUntil(io_, [&] { return Master().text != "not opened yet"; }));
  EXPECT_FALSE(Master().is_open);
  for (int i = 0; i < 2; ++i) {
    PlugIn();
    ASSERT_TRUE(RunUntilOpen(true));
    heard_ = 0;
    EXPECT_TRUE(Master().is_open);
    EXPECT_EQ(Master().frames, static_cast<std::uint64_t>(i));
    AskForTheValue();
    EXPECT_EQ(Master().frames, static_cast<std::uint64_t>(i) + 1);
    EXPECT_NE(Master().last_frame, WallTime{});
    Unplug();
    ASSERT_TRUE(RunUntilOpen(false));
    EXPECT_FALSE(Master().is_open);
    EXPECT_TRUE(shared_->book()->Status({}).clients.empty());
  }
}

TEST_F(SerialListenerTest, ALeftListenerReleasesItsPort) {
  Begin();
  AskForTheValue();
  serial_->Leave();
  EXPECT_TRUE(shared_->book()->Status({}).masters.empty());
  EXPECT_TRUE(shared_->book()->Status({}).clients.empty());
  std::thread([&] { serial_->ClosePort(); }).join();
  RunReady(io_);
  serial_ = std::make_shared<SerialListener>(io_, listener(), *shared_);
  serial_->Open();
  ASSERT_TRUE(RunUntilOpen(true)) << "it is free";
  AskForTheValue();
}

TEST_F(SerialListenerTest, AReplyAfterTheEndOfTheListenerIsDropped) {
  Begin();
  Say(20, "03 00 C8 00 01");
  ASSERT_TRUE(RunUntil(io_, [&] { return target_.requests.size() == 1; }));
  Unplug();
  ASSERT_TRUE(RunUntilOpen(false));
  EXPECT_EQ(target_.forgotten, 1);
  target_.Answer(0, "03 02 09 C4");
  serial_->Stop();
  serial_.reset();
  RunReady(io_);
  EXPECT_EQ(ToHex(View(master_->received()).subspan(heard_)), "");
}

}  // namespace
}  // namespace baudgate::modbus
