// Bytes over a serial port, both ways, over real ptys.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "tests/transports/serial_port_fixture.h"

namespace baudgate {
namespace {

TEST_F(SerialPortTest, CarriesEveryByteBothWays) {
  Open();
  port_->Send(test::AllBytes());
  EXPECT_TRUE(test::RunUntil(io_, [&] { return far_->received().size() >= 256; }));
  EXPECT_EQ(far_->received(), test::AllBytes());
  far_->Write(test::AllBytes());
  EXPECT_TRUE(WaitForReceived(256));
  EXPECT_EQ(listener_.received, test::AllBytes());
  EXPECT_EQ(port_->Counters().parity, 0U);
}

TEST_F(SerialPortTest, PiecesArriveInOrder) {
  Open();
  for (const std::uint8_t byte : ToBytes("<1D:0.52:7F\r\n")) {
    const std::size_t before = listener_.received.size();
    far_->Write({byte});
    ASSERT_TRUE(WaitForReceived(before + 1));
  }
  EXPECT_EQ(AsText(listener_.received), "<1D:0.52:7F\r\n");
}

TEST_F(SerialPortTest, SendsMoreThanTheDriverTakesAtOnce) {
  Open();
  Bytes much;
  for (int i = 0; i < 60'000; ++i) much.push_back(static_cast<std::uint8_t>(i % 251));
  port_->Send(View(much).first(40'000));
  port_->Send(View(much).subspan(40'000));
  EXPECT_TRUE(test::RunUntil(io_, [&] { return far_->received().size() >= much.size(); }));
  EXPECT_EQ(far_->received(), much);
}

/// A pty says that nothing waits although the other side has read nothing.
TEST_F(SerialPortTest, WhatIsOutIsNotTakenBackByAReset) {
  stalled_ = true;
  Plug();
  Open();
  port_->Send(Bytes(1000, 'x'));
  ASSERT_TRUE(port_->IsDrained());
  ASSERT_TRUE(port_->Reset(serial_).ok());
  far_->Start();
  EXPECT_TRUE(test::RunUntil(io_, [&] { return far_->received().size() >= 1000; }));
}

}  // namespace
}  // namespace baudgate
