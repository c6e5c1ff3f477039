// A serial port whose far end reads nothing, over real ptys: what is dropped, and when the port is
// lost.
// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <gtest/gtest.h>
#include <termios.h>
#include <unistd.h>

#include "tests/transports/serial_port_fixture.h"

namespace baudgate {
namespace {

TEST_F(SerialPortTest, APortThatTakesNothingIsLost) {
  Open();
  const Bytes piece(40'000, 'x');
  for (int i = 0; i < 3; ++i) port_->Send(piece);
  EXPECT_TRUE(listener_.losses.empty()) << "no callback from within the call";
  ASSERT_TRUE(test::RunUntil(io_, [&] { return !listener_.losses.empty(); }));
  EXPECT_NE(listener_.losses[0].find("takes no data"), std::string::npos);
  EXPECT_FALSE(port_->is_open());
}

/// It stays stopped after that program has ended, and while the far end is open.
TEST_F(SerialPortTest, AnOutputThatAnotherProgramHasStoppedGoesOn) {
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

/// The kernel keeps for the far end of a pty what it has room for there (see serial_settings.h);
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

}  // namespace
}  // namespace baudgate
