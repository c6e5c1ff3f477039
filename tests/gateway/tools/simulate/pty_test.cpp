// Tests of `Pty`, and of the serial settings of a reader.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/simulate/pty.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include <asio/io_context.hpp>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numeric>
#include <utility>

#include "gateway/base/text.h"
#include "gateway/tools/simulate/simulator.h"
#include "gateway/tools/simulate/twin_port.h"
#include "tests/support/toy_protocol.h"
#include "transports/parity.h"
#include "transports/serial_settings.h"

namespace baudgate::tools {
namespace {

namespace fs = std::filesystem;

class PtyLink : public ::testing::Test {
 protected:
  PtyLink() {
    std::string pattern = (fs::temp_directory_path() / "baudgate-pty-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
    link_ = folder_ / "line";
  }
  ~PtyLink() override { fs::remove_all(folder_); }

  fs::path folder_;
  fs::path link_;
};

TEST_F(PtyLink, LeadsToTheSlaveAndIsRemovedAtTheEnd) {
  {
    const auto pty = Pty::Create(link_.string());
    ASSERT_TRUE(pty.ok()) << pty.error();
    EXPECT_EQ(fs::read_symlink(link_), pty->slave_path());
    EXPECT_EQ(pty->path(), link_.string());
  }
  EXPECT_FALSE(fs::is_symlink(link_));
  EXPECT_TRUE(fs::is_empty(folder_));
}

TEST_F(PtyLink, ReplacesAnOldLinkOnly) {
  fs::create_symlink("/dev/pts/999999", link_);
  auto first = Pty::Create(link_.string());
  ASSERT_TRUE(first.ok());
  fs::remove(link_);
  const auto second = Pty::Create(link_.string());
  ASSERT_TRUE(second.ok());
  first->Unplug();
  EXPECT_EQ(fs::read_symlink(link_), second->slave_path()) << "the link is no longer the first's";

  std::ofstream(folder_ / "file") << "precious";
  const auto third = Pty::Create((folder_ / "file").string());
  ASSERT_FALSE(third.ok());
  EXPECT_NE(third.error().find("is no link"), std::string::npos);
  EXPECT_EQ(fs::file_size(folder_ / "file"), 8U);
}

TEST_F(PtyLink, OfARunningTwinIsNotReplaced) {
  const auto first = Pty::Create(link_.string());
  ASSERT_TRUE(first.ok());
  const auto second = Pty::Create(link_.string());
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error(),
            link_.string() + " is a link to " + first->slave_path() +
                ", which is served by this program itself; end this program first, or "
                "choose another path");
  EXPECT_EQ(fs::read_symlink(link_), first->slave_path());
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 1) << "nothing is left behind";
}

/// A killed simulated device leaves its link, and the kernel gives the number of its pty to the
/// next terminal.
TEST_F(PtyLink, ToAReusedPtyNumberIsReplaced) {
  const auto stranger = Pty::Create();
  ASSERT_TRUE(stranger.ok());
  fs::create_symlink(stranger->slave_path(), link_);
  const timespec before[2] = {{1, 0}, {1, 0}};
  ASSERT_EQ(utimensat(AT_FDCWD, link_.c_str(), before, AT_SYMLINK_NOFOLLOW), 0);
  const auto pty = Pty::Create(link_.string());
  ASSERT_TRUE(pty.ok()) << pty.error();
  EXPECT_EQ(fs::read_symlink(link_), pty->slave_path());
}

TEST_F(PtyLink, ToAnotherDeviceIsNotReplaced) {
  fs::create_symlink("/dev/ttyUSB0", link_);
  const auto pty = Pty::Create(link_.string());
  ASSERT_FALSE(pty.ok());
  EXPECT_NE(pty.error().find("which is no pty"), std::string::npos);
  EXPECT_EQ(fs::read_symlink(link_), "/dev/ttyUSB0");
}

TEST_F(PtyLink, MissingFolderIsAnError) {
  const auto pty = Pty::Create((folder_ / "none" / "line").string());
  ASSERT_FALSE(pty.ok());
  EXPECT_NE(pty.error().find("cannot make the link"), std::string::npos);
}

TEST(Pty, PassesEveryByteUntouched) {
  const auto pty = Pty::Create();
  ASSERT_TRUE(pty.ok());
  const int slave = open(pty->path().c_str(), O_RDWR | O_NOCTTY);
  const std::string sent("\x00\x03\x04\x0A\x0D\x11\x13\x1A\x7F\xFF", 10);
  ASSERT_EQ(write(pty->master(), sent.data(), sent.size()), 10);
  char got[16];
  ASSERT_EQ(read(slave, got, sizeof got), 10);
  EXPECT_EQ(std::string(got, 10), sent);
  close(slave);
}

TEST(Pty, ALeavingReaderDoesNotHangUpTheTwin) {
  const auto pty = Pty::Create();
  close(open(pty->path().c_str(), O_RDWR | O_NOCTTY));
  char byte = 0;
  EXPECT_EQ(read(pty->master(), &byte, 1), -1);
  EXPECT_EQ(errno, EAGAIN);
}

TEST(Pty, UnplugHangsUpTheReader) {
  auto pty = Pty::Create();
  const int slave = open(pty->path().c_str(), O_RDWR | O_NOCTTY);
  pty->Unplug();
  EXPECT_EQ(pty->master(), -1);
  char byte = 0;
  EXPECT_LE(read(slave, &byte, 1), 0);
  close(slave);
}

TEST(Pty, MovesWithoutClosing) {
  auto made = Pty::Create();
  const int master = made->master();
  const Pty moved = std::move(*made);
  EXPECT_EQ(made->master(), -1);
  EXPECT_EQ(moved.master(), master);
  EXPECT_NE(fcntl(master, F_GETFD), -1);
}

using config::Parity;

const std::string kProbe = "PA0\r";

config::SerialSettings Serial(int baud, int data, Parity parity) {
  config::SerialSettings serial;
  serial.baud = baud;
  serial.data_bits = data;
  serial.parity = parity;
  return serial;
}

TEST(PtySettings, ReportTheSettingsOfAReader) {
  auto pty = Pty::Create();
  ASSERT_TRUE(pty) << pty.error();
  const int slave = open(pty->path().c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
  ASSERT_GE(slave, 0);
  for (const auto& device : {Serial(9600, 7, Parity::even), Serial(19200, 8, Parity::odd),
                             Serial(300, 8, Parity::none)}) {
    ASSERT_TRUE(transports::SetPtyFormat(pty->master(), device));
    EXPECT_EQ(transports::ReadPtyFormat(pty->master(), device).ToString(), device.ToString());
    for (const auto& user : {Serial(9600, 8, Parity::none), Serial(115200, 8, Parity::even),
                             Serial(4800, 8, Parity::odd)}) {
      ASSERT_TRUE(transports::ApplySerialSettings(slave, user, "pty"));
      const auto seen = transports::ReadPtyFormat(pty->master(), device);
      EXPECT_EQ(seen.baud, user.baud);
      EXPECT_EQ(seen.parity, user.parity) << user.ToString() << " at " << device.ToString();
    }
  }
  close(slave);
}

/// The rate B0 means "hang up". The code must not divide by it.
TEST(PtySettings, AReaderThatHangsUpSetsNoRate) {
  auto pty = Pty::Create();
  ASSERT_TRUE(pty) << pty.error();
  const auto device = Serial(19200, 8, Parity::none);
  ASSERT_TRUE(transports::SetPtyFormat(pty->master(), device));
  termios mode{};
  ASSERT_EQ(tcgetattr(pty->master(), &mode), 0);
  cfsetospeed(&mode, B0);
  ASSERT_EQ(tcsetattr(pty->master(), TCSANOW, &mode), 0);
  EXPECT_EQ(transports::ReadPtyFormat(pty->master(), device).baud, 19200);
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
  const protocols::Protocol toy_ = ToyProtocol();
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

TEST_F(Bench, AReaderWithTheRightBitRateOrNoneIsAnswered) {
  Inhabit(Strict());
  Open();
  const std::string reply = Ask(kProbe);
  EXPECT_FALSE(reply.empty());
  ASSERT_TRUE(transports::ApplySerialSettings(fd_, Serial(9600, 8, Parity::none), "pty"));
  EXPECT_EQ(Ask(kProbe), reply);
}

TEST_F(Bench, AReaderWithAnotherBitRateOrParityGetsGarbage) {
  Inhabit(Strict());
  Open();
  const std::string reply = Ask(kProbe);
  for (const auto& wrong : {Serial(19200, 8, Parity::none), Serial(1200, 8, Parity::none),
                            Serial(9600, 8, Parity::odd), Serial(9600, 8, Parity::even)}) {
    ASSERT_TRUE(transports::ApplySerialSettings(fd_, wrong, "pty"));
    const std::string heard = Ask(kProbe, false);
    EXPECT_FALSE(heard.empty()) << wrong.ToString();
    EXPECT_NE(heard, reply.substr(0, heard.size())) << wrong.ToString();
  }
  ASSERT_TRUE(transports::ApplySerialSettings(fd_, Serial(9600, 8, Parity::none), "pty"));
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
  for (int connection = 0; connection < 40;
       ++connection) {  // more than the simulated device allows at once
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

config::SerialSettings Format(int baud, int data, Parity parity, int stop = 1) {
  config::SerialSettings serial;
  serial.baud = baud;
  serial.data_bits = data;
  serial.parity = parity;
  serial.stop_bits = stop;
  return serial;
}

Bytes Alphabet(int data) {
  Bytes all(std::size_t{1} << static_cast<unsigned>(data));
  std::iota(all.begin(), all.end(), std::uint8_t{0});
  return all;
}

TEST(Uart, EqualSettingsCarryEveryCharacter) {
  for (const int baud : {300, 9600, 115200, 921600}) {
    for (const int data : {7, 8}) {
      for (const Parity parity : {Parity::none, Parity::even, Parity::odd}) {
        const auto serial = Format(baud, data, parity);
        const Received received = ReceiveAs(serial, Alphabet(data), serial);
        EXPECT_EQ(received.bytes, Alphabet(data)) << serial.ToString();
        EXPECT_EQ(received.damaged, 0U);
        EXPECT_TRUE(Understand(serial, serial));
      }
    }
  }
}

TEST(Uart, AClockErrorOfTwoPerCentIsTolerated) {
  const auto right = Format(9600, 8, Parity::none);
  const auto fast = Format(9792, 8, Parity::none);
  EXPECT_EQ(ReceiveAs(right, Alphabet(8), fast).bytes, Alphabet(8));
  EXPECT_TRUE(Understand(right, fast));
}

TEST(Uart, AnotherBitRateGivesGarbage) {
  const Bytes reply = ToBytes("1D:2.35/0.12/0.00/0.00:4C\r\n");
  for (const int baud : {1200, 2400, 4800, 19200, 38400, 115200}) {
    const auto user = Format(baud, 8, Parity::none);
    const Received received = ReceiveAs(user, reply, Format(9600, 8, Parity::none));
    EXPECT_FALSE(received.bytes.empty()) << baud;
    EXPECT_NE(received.bytes, reply) << baud;
    EXPECT_LE(received.bytes.size(), 5 * reply.size()) << baud;
  }
}

TEST(Uart, AWrongParityDamagesCharacters) {
  const Received received =
      ReceiveAs(Format(9600, 8, Parity::odd), Alphabet(8), Format(9600, 8, Parity::even));
  EXPECT_EQ(received.damaged, Alphabet(8).size());
  const Received none =
      ReceiveAs(Format(9600, 8, Parity::none), Alphabet(8), Format(9600, 8, Parity::even));
  EXPECT_GT(none.damaged, 0U);
  EXPECT_NE(none.bytes, Alphabet(8));
}

TEST(Uart, SevenBitsWithParityEqualEightBitsWithout) {
  const auto seven = Format(9600, 7, Parity::even);
  const auto eight = Format(9600, 8, Parity::none);
  Bytes with_parity;
  for (const std::uint8_t byte : Alphabet(7)) {
    with_parity.push_back(transports::WithParity(byte, Parity::even));
  }
  EXPECT_EQ(ReceiveAs(eight, Alphabet(7), seven).bytes, with_parity);
  const Received back = ReceiveAs(seven, with_parity, eight);
  EXPECT_EQ(back.bytes, Alphabet(7));
  EXPECT_EQ(back.damaged, 0U);
}

}  // namespace
}  // namespace baudgate::tools
