// How a serial port is opened and closed, over real ptys.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "tests/transports/serial_port_fixture.h"

namespace baudgate {
namespace {

TEST_F(SerialPortTest, ClosesAndOpensAgainAndAgain) {
  for (int round = 0; round < 20; ++round) {
    Open();
    port_->Send(ToBytes("x"));
    const std::size_t expected = static_cast<std::size_t>(round) + 1;
    ASSERT_TRUE(test::RunUntil(io_, [&] { return far_->received().size() >= expected; }));
    port_->Close();
    EXPECT_FALSE(port_->is_open());
  }
  EXPECT_TRUE(listener_.losses.empty());
  EXPECT_FALSE(far_->ended()) << "the twin is not hung up";
}

TEST_F(SerialPortTest, OldBytesAreDroppedAtOpen) {
  Open();
  port_->Close();
  bool written = false;
  asio::async_write(far_->stream(), asio::buffer("late answer", 11),
                    [&](const std::error_code&, std::size_t) { written = true; });
  ASSERT_TRUE(test::RunUntil(io_, [&] { return written; }));
  Open();
  far_->Write(ToBytes("fresh"));
  EXPECT_TRUE(WaitForReceived(5));
  EXPECT_EQ(AsText(listener_.received), "fresh");
}

TEST_F(SerialPortTest, CloseCancelsOpen) {
  port_ = MakeSerialPort(link_, serial_, io_, listener_);
  port_->Open();
  port_->Close();
  test::RunReady(io_);
  EXPECT_EQ(listener_.opened, 0);
  EXPECT_TRUE(listener_.failures.empty());
}

TEST_F(SerialPortTest, MayBeClosedAndDestroyedFromACallback) {
  Open();
  listener_.on_bytes = [&] { port_->Close(); };
  far_->Write(ToBytes("x"));
  ASSERT_TRUE(WaitForReceived(1));
  Open();
  listener_.on_bytes = [&] { port_.reset(); };
  far_->Write(ToBytes("y"));
  ASSERT_TRUE(WaitForReceived(2));
  test::RunReady(io_);
  EXPECT_TRUE(listener_.losses.empty());
}

TEST_F(SerialPortTest, OnePortServesOneLine) {
  Open();
  test::Recorder other_listener;
  const auto other = MakeSerialPort(link_, serial_, io_, other_listener);
  other->Open();
  ASSERT_TRUE(test::RunUntil(io_, [&] { return !other_listener.failures.empty(); }));
  EXPECT_NE(other_listener.failures[0].find("in use by another line"), std::string::npos);
  port_->Close();
  other->Open();
  EXPECT_TRUE(test::RunUntil(io_, [&] { return other_listener.opened == 1; }));
}

TEST_F(SerialPortTest, AFailedOpenLeavesThePortFree) {
  config::SerialSettings with_rs485 = serial_;
  with_rs485.rs485.enabled = true;
  port_ = MakeSerialPort(link_, with_rs485, io_, listener_);
  port_->Open();
  ASSERT_TRUE(WaitForFailure());
  EXPECT_NE(listener_.failures[0].find("RS-485"), std::string::npos);
  port_.reset();
  Open();
}

}  // namespace
}  // namespace baudgate
