// The settings of an open serial port, over real ptys: parity in software, switching, and what is
// impossible.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <termios.h>

#include "tests/transports/serial_port_fixture.h"
#include "transports/parity.h"
#include "transports/serial_settings.h"

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

/// `stty sane`, ModemManager, brltty: whoever may open the port.
TEST_F(SerialPortTest, SettingsThatAnotherProgramChangesAreSetAgainAndNamed) {
  Open();
  EXPECT_EQ(port_->Restore(), std::nullopt);
  termios sane{};
  const int far = far_->stream().native_handle();  // the kernel takes both ends for the same
  ASSERT_EQ(::tcgetattr(far, &sane), 0);
  sane.c_lflag |= ICANON | ECHO | ISIG;
  sane.c_iflag |= ICRNL | IXON;
  sane.c_oflag |= OPOST;
  ::cfsetspeed(&sane, B38400);
  ASSERT_EQ(::tcsetattr(far, TCSANOW, &sane), 0);
  const std::string changes = port_->Restore().value_or("nothing");
  for (const char* change : {"became 38400", "echo is on", "input comes by whole lines",
                             "input is translated", "output is translated", "XON/XOFF is on"}) {
    EXPECT_NE(changes.find(change), std::string::npos) << change << ": " << changes;
  }
  EXPECT_EQ(port_->Restore(), std::nullopt);
  far_->Write({0x0D});
  ASSERT_TRUE(WaitForReceived(1));
  EXPECT_EQ(listener_.received, Bytes{0x0D}) << "raw again";
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

TEST_F(SerialPortTest, IsOpenedWithItsOwnSettingsWhateverWasAppliedBefore) {
  Open();
  config::SerialSettings other = serial_;
  other.baud = 19200;
  other.parity = config::Parity::none;
  ASSERT_TRUE(port_->Apply(other).ok());
  Unplug();
  ASSERT_TRUE(test::RunUntil(io_, [&] { return !listener_.losses.empty(); }));
  Plug();
  Open();
  EXPECT_EQ(port_->Describe(), "serial " + link_ + " 9600 7E1");
  const auto now = ReadSerialSettings(far_->stream().native_handle());
  ASSERT_TRUE(now.ok());
  EXPECT_EQ(now->baud, 9600);
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
