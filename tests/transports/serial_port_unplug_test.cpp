// A serial port that is unplugged and comes back, over real ptys.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "tests/transports/serial_port_fixture.h"

namespace baudgate {
namespace {

TEST_F(SerialPortTest, UnplugIsReportedOnce) {
  Open();
  Unplug();
  ASSERT_TRUE(test::RunUntil(io_, [&] { return !listener_.losses.empty(); }));
  test::RunReady(io_);
  EXPECT_EQ(listener_.losses.size(), 1U);
  EXPECT_NE(listener_.losses[0].find(link_ + " is gone"), std::string::npos) << listener_.losses[0];
  EXPECT_FALSE(port_->is_open());
  port_->Send(ToBytes("into the void"));
  test::RunReady(io_);
  EXPECT_EQ(listener_.losses.size(), 1U);
}

TEST_F(SerialPortTest, ComesBackAfterReplug) {
  Open();
  Unplug();
  ASSERT_TRUE(test::RunUntil(io_, [&] { return !listener_.losses.empty(); }));
  port_->Open();
  ASSERT_TRUE(WaitForFailure());
  EXPECT_EQ(listener_.failures[0], "no such port " + link_ + "; is the adapter plugged in?");
  Plug();
  Open();
  far_->Write(ToBytes("back"));
  EXPECT_TRUE(WaitForReceived(4));
  EXPECT_EQ(AsText(listener_.received), "back");
}

TEST_F(SerialPortTest, AHangUpWhileSendingIsReportedOnce) {
  Open();
  pty_->Unplug();
  far_->stream().close();  // the kernel has hung up; we have not looked yet
  port_->Send(ToBytes("request"));
  ASSERT_TRUE(test::RunUntil(io_, [&] { return !listener_.losses.empty(); }));
  test::RunReady(io_);
  EXPECT_EQ(listener_.losses.size(), 1U);
  EXPECT_FALSE(port_->is_open());
}

TEST_F(SerialPortTest, WhatCameBeforeTheHangUpIsHeardOrLostButEndsTheSame) {
  Open();
  far_->Write(ToBytes("<1D"));
  test::RunReady(io_);
  Unplug();
  ASSERT_TRUE(test::RunUntil(io_, [&] { return !listener_.losses.empty(); }));
  EXPECT_FALSE(port_->is_open());
}

/// A stable name, as in /dev/serial/by-id: the adapter comes back under another number.
TEST_F(SerialPortTest, ALinkIsFollowedAnewAtEachOpen) {
  Open();
  const std::string first = pty_->slave_path();
  auto other = Pty::Create();
  ASSERT_TRUE(other.ok());
  Far other_far(asio::posix::stream_descriptor(io_, other->TakeMaster()));
  other_far.Start();
  ASSERT_NE(other->slave_path(), first);
  fs::remove(link_);
  fs::create_symlink(other->slave_path(), link_);
  far_->Write(ToBytes("old"));
  ASSERT_TRUE(WaitForReceived(3)) << "the open port stays open";

  Unplug();
  ASSERT_TRUE(test::RunUntil(io_, [&] { return !listener_.losses.empty(); }));
  Open();
  other_far.Write(ToBytes("new"));
  ASSERT_TRUE(WaitForReceived(6));
  EXPECT_EQ(AsText(listener_.received), "oldnew");
}

TEST_F(SerialPortTest, MayBeOpenedAgainFromOnLost) {
  Open();
  listener_.on_lost = [&] { port_->Open(); };
  Unplug();
  ASSERT_TRUE(WaitForFailure());
  EXPECT_EQ(listener_.losses.size(), 1U);
}

}  // namespace
}  // namespace baudgate
