// Tests sending and receiving over a serial port, on real ptys.
// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <gtest/gtest.h>
#include <termios.h>
#include <unistd.h>

#include "tests/transports/serial_port_fixture.h"
#include "transports/parity.h"
#include "transports/serial_settings.h"

namespace baudgate::transports {
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

/// A pty reports an empty output queue although the far end has read nothing.
TEST_F(SerialPortTest, SentBytesAreNotDroppedByAReset) {
  stalled_ = true;
  Plug();
  Open();
  port_->Send(Bytes(1000, 'x'));
  ASSERT_TRUE(port_->IsDrained());
  ASSERT_TRUE(port_->Reset(serial_).ok());
  far_->Start();
  EXPECT_TRUE(test::RunUntil(io_, [&] { return far_->received().size() >= 1000; }));
}

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

TEST_F(SerialPortTest, SoftwareParityIsSentAndChecked) {
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

/// Programs such as `stty sane`, ModemManager and brltty change the settings of a port.
TEST_F(SerialPortTest, SettingsThatAnotherProgramChangesAreSetAgainAndNamed) {
  Open();
  EXPECT_EQ(port_->Restore(), std::nullopt);
  termios sane{};
  // The kernel has one set of settings for both ends of a pty, so the far end can change them.
  const int far = far_->stream().native_handle();
  ASSERT_EQ(::tcgetattr(far, &sane), 0);
  sane.c_lflag |= ICANON | ECHO | ISIG;
  sane.c_iflag |= ICRNL | IXON;
  sane.c_oflag |= OPOST;
  ::cfsetspeed(&sane, B38400);
  ASSERT_EQ(::tcsetattr(far, TCSANOW, &sane), 0);
  const std::string changes = port_->Restore().value_or("nothing");
  for (const char* change : {"became 38400", "echo is on", "input is passed on only in whole lines",
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

TEST_F(SerialPortTest, ApplyOfInvalidSettingsChangesNothing) {
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

TEST_F(SerialPortTest, APortThatTakesNoDataIsLost) {
  Open();
  const Bytes piece(40'000, 'x');
  for (int i = 0; i < 3; ++i) port_->Send(piece);
  EXPECT_TRUE(listener_.losses.empty()) << "no callback from within the call";
  ASSERT_TRUE(test::RunUntil(io_, [&] { return !listener_.losses.empty(); }));
  EXPECT_NE(listener_.losses[0].find("takes no data"), std::string::npos);
  EXPECT_FALSE(port_->is_open());
}

/// The other program stops the output of the tty. The output stays stopped after this program has
/// ended, because the far end keeps the tty open.
TEST_F(SerialPortTest, AnOutputStoppedByAnotherProgramIsResumed) {
  const auto stop = [this] {
    const int other = ::open(link_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK);
    ASSERT_GE(other, 0);
    EXPECT_EQ(::tcflow(other, TCOOFF), 0);
    ::close(other);
  };
  const auto arrives = [this](const std::string& text) {
    port_->Send(ToBytes(text));
    return test::RunUntil(io_, [&] { return AsText(far_->received()).ends_with(text); });
  };
  stop();
  Open();
  EXPECT_TRUE(arrives("one"));
  stop();
  port_->Restore();
  EXPECT_TRUE(arrives("two"));
}

class StalledPort : public SerialPortTest {
 protected:
  StalledPort() {
    stalled_ = true;
    Plug();
    Open();
  }
  std::string ReadUntil(const std::string& end) {
    far_->Start();
    std::string text;
    EXPECT_TRUE(test::RunUntil(io_, [&] {
      text = AsText(far_->received());
      return text.ends_with(end);
    }));
    return text;
  }
  /// More than a pty accepts, so the rest stays in the port's own queue.
  const Bytes much_ = Bytes(40'000, 'x');
};

/// The kernel delivers the bytes that are already in its buffer for the far end
/// (transports/serial_settings.h). All later bytes are dropped.
TEST_F(StalledPort, GetsNoMoreBytesOfAnAbandonedRequest) {
  port_->Send(much_);
  test::RunReady(io_);
  port_->DropUnsent();
  port_->Send(ToBytes("stop"));
  const std::string text = ReadUntil("stop");
  EXPECT_LE(text.size(), 4096 + 4U);
  EXPECT_TRUE(listener_.losses.empty());
}

TEST_F(StalledPort, GetsNoMoreBytesAfterClosing) {
  port_->Send(much_);
  test::RunReady(io_);
  port_->Close();
  Open();
  port_->Send(ToBytes("stop"));
  EXPECT_LE(ReadUntil("stop").size(), 4096 + 4U);
}

TEST_F(StalledPort, IsLostWhenNoRequestGetsOut) {
  for (int i = 0; i < 5; ++i) {
    EXPECT_TRUE(listener_.losses.empty());
    EXPECT_TRUE(port_->is_open());
    port_->Send(much_);
    port_->DropUnsent();
    test::RunReady(io_);
  }
  ASSERT_EQ(listener_.losses.size(), 1U);
  EXPECT_EQ(listener_.losses[0], link_ + " takes no data");
  EXPECT_FALSE(port_->is_open());
}

TEST_F(StalledPort, IsNotLostWhileItSendsBytes) {
  for (int i = 0; i < 20; ++i) {
    port_->Send(much_);
    port_->DropUnsent();
    far_->Write(ToBytes("x"));
    ASSERT_TRUE(WaitForReceived(static_cast<std::size_t>(i) + 1));
  }
  EXPECT_TRUE(listener_.losses.empty());
}

TEST_F(SerialPortTest, DropUnsentKeepsSentBytes) {
  Open();
  for (int round = 1; round <= 20; ++round) {
    port_->Send(ToBytes("request"));
    const std::size_t expected = static_cast<std::size_t>(round) * 7;
    ASSERT_TRUE(test::RunUntil(io_, [&] { return far_->received().size() >= expected; }));
    port_->DropUnsent();
  }
  test::RunReady(io_);
  EXPECT_TRUE(listener_.losses.empty());
  EXPECT_TRUE(port_->is_open());
}

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
  EXPECT_EQ(listener_.failures[0],
            "no such port " + link_ + "; plug the adapter in, or correct port");
  Plug();
  Open();
  far_->Write(ToBytes("back"));
  EXPECT_TRUE(WaitForReceived(4));
  EXPECT_EQ(AsText(listener_.received), "back");
}

TEST_F(SerialPortTest, AHangUpWhileSendingIsReportedOnce) {
  Open();
  pty_->Unplug();
  far_->stream().close();
  port_->Send(ToBytes("request"));
  ASSERT_TRUE(test::RunUntil(io_, [&] { return !listener_.losses.empty(); }));
  test::RunReady(io_);
  EXPECT_EQ(listener_.losses.size(), 1U);
  EXPECT_FALSE(port_->is_open());
}

TEST_F(SerialPortTest, BytesBeforeAHangUpDoNotPreventTheLossReport) {
  Open();
  far_->Write(ToBytes("<1D"));
  test::RunReady(io_);
  Unplug();
  ASSERT_TRUE(test::RunUntil(io_, [&] { return !listener_.losses.empty(); }));
  EXPECT_FALSE(port_->is_open());
}

/// The link is a stable name, as in /dev/serial/by-id. The adapter comes back under another number.
TEST_F(SerialPortTest, ALinkIsResolvedAgainAtEachOpen) {
  Open();
  const std::string first = pty_->slave_path();
  auto other = tools::Pty::Create();
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
}  // namespace baudgate::transports
