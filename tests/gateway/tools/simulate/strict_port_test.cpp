// Twins on a bench: readers with other settings, several protocols on one line, and TCP.
// SPDX-License-Identifier: Apache-2.0
#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <asio/io_context.hpp>

#include "gateway/tools/simulate/pty.h"
#include "gateway/tools/simulate/simulator.h"
#include "tests/support/toy_protocol.h"
#include "transports/serial_settings.h"

namespace baudgate {
namespace {

using config::Parity;

const std::string kProbe = "PA0\r";

config::SerialSettings Serial(int baud, int data, Parity parity) {
  config::SerialSettings serial;
  serial.baud = baud;
  serial.data_bits = data;
  serial.parity = parity;
  return serial;
}

TEST(PtySettings, SayWhatAReaderHasSetAsFarAsThePtyKeepsIt) {
  auto pty = Pty::Create();
  ASSERT_TRUE(pty) << pty.error();
  const int slave = open(pty->path().c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
  ASSERT_GE(slave, 0);
  for (const auto& device : {Serial(9600, 7, Parity::even), Serial(19200, 8, Parity::odd),
                             Serial(300, 8, Parity::none)}) {
    ASSERT_TRUE(SetPtyFormat(pty->master(), device));
    EXPECT_EQ(ReadPtyFormat(pty->master(), device).ToString(), device.ToString());
    for (const auto& user : {Serial(9600, 8, Parity::none), Serial(115200, 8, Parity::even),
                             Serial(4800, 8, Parity::odd)}) {
      ASSERT_TRUE(ApplySerialSettings(slave, user, "pty"));
      const auto seen = ReadPtyFormat(pty->master(), device);
      EXPECT_EQ(seen.baud, user.baud);
      EXPECT_EQ(seen.parity, user.parity) << user.ToString() << " at " << device.ToString();
    }
  }
  close(slave);
}

/// "Hang up", as any program may set it: zero characters a second would be a division by zero.
TEST(PtySettings, AReaderThatHangsUpSetsNoRate) {
  auto pty = Pty::Create();
  ASSERT_TRUE(pty) << pty.error();
  const auto device = Serial(19200, 8, Parity::none);
  ASSERT_TRUE(SetPtyFormat(pty->master(), device));
  termios mode{};
  ASSERT_EQ(tcgetattr(pty->master(), &mode), 0);
  cfsetospeed(&mode, B0);
  ASSERT_EQ(tcsetattr(pty->master(), TCSANOW, &mode), 0);
  EXPECT_EQ(ReadPtyFormat(pty->master(), device).baud, 19200);
}

class Bench : public ::testing::Test {
 protected:
  ~Bench() override {
    if (fd_ >= 0) close(fd_);
  }

  void Inhabit(const SimulatorOptions& options) {
    config::Device device;
    device.name = "toy";
    device.address = "A";
    device.protocol = toy_.name;
    auto made = Simulator::Create(io_, toy_, {device}, options);
    ASSERT_TRUE(made) << made.error();
    simulator_ = std::move(*made);
  }
  void Open() {
    fd_ = open(simulator_->path().c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    ASSERT_GE(fd_, 0);
  }
  /// What comes back: the whole reply, or the first bytes of what came in its place.
  std::string Ask(const std::string& request, bool whole = true) {
    const std::uint64_t before = simulator_->answered();
    EXPECT_EQ(write(fd_, request.data(), request.size()), static_cast<ssize_t>(request.size()));
    std::string reply;
    const Instant limit = std::chrono::steady_clock::now() + 20s;
    while (std::chrono::steady_clock::now() < limit) {
      io_.run_for(1ms);
      char buffer[256];
      const ssize_t count = read(fd_, buffer, sizeof buffer);
      if (count > 0) reply.append(buffer, static_cast<std::size_t>(count));
      const bool over = whole ? reply.ends_with('\r') : !reply.empty();
      if (simulator_->answered() > before && over) break;
    }
    return reply;
  }

  asio::io_context io_{1};
  const Protocol toy_ = ToyProtocol();
  std::unique_ptr<Simulator> simulator_;
  int fd_ = -1;
};

SimulatorOptions Strict() {
  SimulatorOptions options;
  options.pace = Serial(9600, 8, Parity::none);
  options.strict = true;
  options.think_time = {};
  return options;
}

TEST_F(Bench, AReaderThatSetsTheRightBitRateOrNoneIsUnderstood) {
  Inhabit(Strict());
  Open();
  const std::string reply = Ask(kProbe);
  EXPECT_FALSE(reply.empty());
  ASSERT_TRUE(ApplySerialSettings(fd_, Serial(9600, 8, Parity::none), "pty"));
  EXPECT_EQ(Ask(kProbe), reply);
}

TEST_F(Bench, AReaderWithAnotherBitRateOrParityGetsGarbage) {
  Inhabit(Strict());
  Open();
  const std::string reply = Ask(kProbe);
  for (const auto& wrong : {Serial(19200, 8, Parity::none), Serial(1200, 8, Parity::none),
                            Serial(9600, 8, Parity::odd), Serial(9600, 8, Parity::even)}) {
    ASSERT_TRUE(ApplySerialSettings(fd_, wrong, "pty"));
    const std::string heard = Ask(kProbe, false);
    EXPECT_FALSE(heard.empty()) << wrong.ToString();
    EXPECT_NE(heard, reply.substr(0, heard.size())) << wrong.ToString();
  }
  ASSERT_TRUE(ApplySerialSettings(fd_, Serial(9600, 8, Parity::none), "pty"));
  EXPECT_TRUE(Ask(kProbe).ends_with(reply)) << "behind what was still on its way";
}

TEST_F(Bench, AnswersOverTcp) {
  SimulatorOptions options;
  options.listen = config::HostPort{"127.0.0.1", 0};
  options.think_time = {};
  Inhabit(options);
  ASSERT_EQ(simulator_->path().rfind("tcp://127.0.0.1:", 0), 0U) << simulator_->path();
  const auto at = config::ParseHostPort(simulator_->path().substr(6));
  ASSERT_TRUE(at);
  for (int connection = 0; connection < 40; ++connection) {  // more than it keeps
    if (fd_ >= 0) close(fd_);
    fd_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(at->port);
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    ASSERT_EQ(connect(fd_, reinterpret_cast<sockaddr*>(&to), sizeof to), 0);
    ASSERT_EQ(fcntl(fd_, F_SETFL, O_NONBLOCK), 0);
    ASSERT_FALSE(Ask(kProbe).empty()) << connection;
  }
}

}  // namespace
}  // namespace baudgate
