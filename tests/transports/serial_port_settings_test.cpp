// The settings of an open serial port, over real ptys: parity in software, switching, and what is
// impossible.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "tests/transports/serial_port_fixture.h"
#include "transports/damage.h"
#include "transports/parity.h"

namespace baudgate {
namespace {

TEST_F(SerialPortTest, SoftwareParityOnTheWire) {
  serial_.software_parity = true;
  Open();
  port_->Send(ToBytes(">1RF:XX\r"));
  ASSERT_TRUE(test::RunUntil(io_, [&] { return far_->received().size() >= 8; }));
  const SoftwareParity coder(config::Parity::even);
  EXPECT_EQ(far_->received(), coder.Encode(ToBytes(">1RF:XX\r")));

  Bytes reply = coder.Encode(ToBytes("<1D"));
  reply[1] ^= 0x01;
  far_->Write(reply);
  ASSERT_TRUE(WaitForReceived(3));
  EXPECT_EQ(listener_.received, (Bytes{'<', kDamaged, 'D'}));
  EXPECT_EQ(port_->Counters().parity, 1U);
  port_->Close();
  Open();
  EXPECT_EQ(port_->Counters().parity, 0U) << "counted since the port was opened";
}

TEST_F(SerialPortTest, ApplySwitchesTheOpenPort) {
  Open();
  EXPECT_EQ(port_->Describe(), "serial " + link_ + " 9600 7E1");
  config::SerialSettings other = serial_;
  other.baud = 19200;
  other.parity = config::Parity::odd;
  other.software_parity = true;
  ASSERT_TRUE(port_->Apply(other).ok());
  EXPECT_EQ(port_->Describe(), "serial " + link_ + " 19200 7O1");
  port_->Send(ToBytes("A"));
  ASSERT_TRUE(test::RunUntil(io_, [&] { return !far_->received().empty(); }));
  EXPECT_EQ(far_->received(), Bytes{0xC1});

  far_->Write({0x41});
  ASSERT_TRUE(WaitForReceived(1));
  ASSERT_TRUE(port_->Apply(serial_).ok());
  EXPECT_EQ(port_->Counters().parity, 1U) << "switching forgets no error";
  port_->Close();
  Open();
  EXPECT_EQ(port_->Counters().parity, 0U);
}

TEST_F(SerialPortTest, ApplyOfNonsenseChangesNothing) {
  Open();
  config::SerialSettings other = serial_;
  other.baud = 5;
  EXPECT_FALSE(port_->Apply(other).ok());
  EXPECT_EQ(port_->Describe(), "serial " + link_ + " 9600 7E1");
  EXPECT_TRUE(port_->Apply(serial_).ok());
}

TEST_F(SerialPortTest, ImpossibleSettingsFailTheOpen) {
  serial_.data_bits = 8;
  serial_.software_parity = true;
  port_ = MakeSerialPort(link_, serial_, io_, listener_);
  port_->Open();
  ASSERT_TRUE(WaitForFailure());
  EXPECT_NE(listener_.failures[0].find("software parity"), std::string::npos);
}

}  // namespace
}  // namespace baudgate
