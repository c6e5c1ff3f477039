// The serial transport over real ptys: what arrives, what is lost, and what the listener hears.
// SPDX-License-Identifier: Apache-2.0
#include "transports/serial_port.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <asio/posix/stream_descriptor.hpp>
#include <filesystem>
#include <optional>

#include "gateway/simulate/pty.h"
#include "tests/transports/far_end.h"
#include "transports/damage.h"
#include "transports/parity.h"

namespace baudgate {
namespace {

namespace fs = std::filesystem;
using Far = test::FarEnd<asio::posix::stream_descriptor>;

class SerialPortTest : public testing::Test {
 protected:
  SerialPortTest() {
    std::string pattern = (fs::temp_directory_path() / "baudgate-port-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
    link_ = (folder_ / "line").string();
    serial_.data_bits = 7;
    serial_.parity = config::Parity::even;
    Plug();
  }
  ~SerialPortTest() override {
    port_.reset();
    fs::remove_all(folder_);
  }

  void Plug() {
    auto pty = Pty::Create(link_);
    ASSERT_TRUE(pty.ok()) << pty.error();
    pty_.emplace(std::move(*pty));
    far_.emplace(asio::posix::stream_descriptor(io_, pty_->TakeMaster()));
    if (!stalled_) far_->Start();
  }
  void Unplug() {
    pty_->Unplug();
    far_->stream().close();
  }
  void Open() {
    if (!port_) port_ = MakeSerialPort(link_, serial_, io_, listener_);
    const int before = listener_.opened;
    port_->Open();
    EXPECT_EQ(listener_.opened, before) << "no callback from within the call";
    ASSERT_TRUE(test::RunUntil(io_, [&] { return listener_.opened > before; })) << Failure();
    EXPECT_TRUE(port_->is_open());
  }
  std::string Failure() const {
    return listener_.failures.empty() ? "no answer to Open" : listener_.failures.back();
  }
  bool WaitForReceived(std::size_t count) {
    return test::RunUntil(io_, [&] { return listener_.received.size() >= count; });
  }
  bool WaitForFailure() {
    return test::RunUntil(io_, [&] { return !listener_.failures.empty(); });
  }

  asio::io_context io_;
  bool stalled_ = false;  // the far end reads nothing
  fs::path folder_;
  std::string link_;
  config::SerialSettings serial_;
  test::Recorder listener_;
  std::optional<Pty> pty_;
  std::optional<Far> far_;
  std::unique_ptr<Transport> port_;
};

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

TEST_F(SerialPortTest, APortThatTakesNothingIsLost) {
  Open();
  const Bytes piece(40'000, 'x');
  for (int i = 0; i < 3; ++i) port_->Send(piece);
  EXPECT_TRUE(listener_.losses.empty()) << "no callback from within the call";
  ASSERT_TRUE(test::RunUntil(io_, [&] { return !listener_.losses.empty(); }));
  EXPECT_NE(listener_.losses[0].find("takes no data"), std::string::npos);
  EXPECT_FALSE(port_->is_open());
}

class StalledPort : public SerialPortTest {
 protected:
  StalledPort() {
    stalled_ = true;
    Plug();
    Open();
  }
  /// What the far end reads up to this text.
  std::string ReadUntil(const std::string& end) {
    far_->Start();
    std::string text;
    EXPECT_TRUE(test::RunUntil(io_, [&] {
      text = AsText(far_->received());
      return text.ends_with(end);
    }));
    return text;
  }
  /// More than a pty takes: the rest is in our own queue.
  const Bytes much_ = Bytes(40'000, 'x');
};

/// Of a pty the kernel keeps for the far end what it has room for there (see serial_settings.h);
/// neither the driver's queue nor ours may follow when the far end reads again.
TEST_F(StalledPort, GetsNothingMoreOfAGivenUpRequest) {
  port_->Send(much_);
  test::RunReady(io_);
  port_->DropUnsent();
  port_->Send(ToBytes("stop"));
  const std::string text = ReadUntil("stop");
  EXPECT_LE(text.size(), 4096 + 4U);
  EXPECT_TRUE(listener_.losses.empty());
}

TEST_F(StalledPort, GetsNothingMoreAfterTheClosing) {
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

TEST_F(StalledPort, ThatSaysSomethingIsNotLost) {
  for (int i = 0; i < 20; ++i) {
    port_->Send(much_);
    port_->DropUnsent();
    far_->Write(ToBytes("x"));
    ASSERT_TRUE(WaitForReceived(static_cast<std::size_t>(i) + 1));
  }
  EXPECT_TRUE(listener_.losses.empty());
}

/// Silent devices are no reason to think ill of the port.
TEST_F(SerialPortTest, DropsNothingThatHasGoneOut) {
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

TEST_F(SerialPortTest, MayBeOpenedAgainFromOnLost) {
  Open();
  listener_.on_lost = [&] { port_->Open(); };
  Unplug();
  ASSERT_TRUE(WaitForFailure());
  EXPECT_EQ(listener_.losses.size(), 1U);
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

TEST(MakeTransport, FormOfThePortDecides) {
  asio::io_context io;
  test::Recorder listener;
  config::Line line;
  line.port = "/dev/ttyUSB0";
  EXPECT_EQ(MakeTransport(line, io, listener)->Describe(), "serial /dev/ttyUSB0 9600 8N1");
  line.port = "tcp://[::1]:4001";
  EXPECT_EQ(MakeTransport(line, io, listener)->Describe(), "tcp://[::1]:4001 9600 8N1");
}

}  // namespace
}  // namespace baudgate
