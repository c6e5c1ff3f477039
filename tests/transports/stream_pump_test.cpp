// Tests how errors of a dying tty end a session. The stream is a fake, because a pty cannot produce
// all these errors.
// SPDX-License-Identifier: Apache-2.0
#include "transports/stream_pump.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <asio/io_context.hpp>
#include <vector>

#include "tests/transports/far_end.h"
#include "transports/listen_socket.h"
#include "transports/serial_port.h"
#include "transports/transport.h"

namespace baudgate::transports {
namespace {

using Handler = std::function<void(const std::error_code&, std::size_t)>;

struct Wire {
  Handler reading;
  std::function<void(const std::error_code&)> waiting;
  std::size_t room = 0;
  std::error_code write_error;
  Bytes written;
};

class FakeStream {
 public:
  enum Wait { wait_write };

  FakeStream(asio::io_context& io, std::shared_ptr<Wire> wire) : io_(io), wire_(std::move(wire)) {}
  asio::io_context::executor_type get_executor() { return io_.get_executor(); }
  void non_blocking(bool, std::error_code&) {}
  template <typename Buffer>
  void async_read_some(const Buffer&, Handler handler) {
    wire_->reading = std::move(handler);
  }
  template <typename Buffer>
  std::size_t write_some(const Buffer& buffer, std::error_code& error) {
    error = wire_->room == 0 ? asio::error::would_block : wire_->write_error;
    if (error) return 0;
    const std::size_t count = std::min(wire_->room, buffer.size());
    Append(wire_->written, View(static_cast<const std::uint8_t*>(buffer.data()), count));
    wire_->room -= count;
    return count;
  }
  void async_wait(Wait, std::function<void(const std::error_code&)> handler) {
    wire_->waiting = std::move(handler);
  }

 private:
  asio::io_context& io_;
  std::shared_ptr<Wire> wire_;
};

class SessionTest : public testing::Test {
 protected:
  SessionTest() { session_->Start(); }
  ~SessionTest() override {
    wire_->reading = {};
    wire_->waiting = {};
  }
  void MakeRoom(std::size_t count) {
    wire_->room = count;
    if (wire_->waiting) std::exchange(wire_->waiting, {})({});
  }

  asio::io_context io_;
  std::shared_ptr<Wire> wire_ = std::make_shared<Wire>();
  std::vector<std::error_code> ends_;
  std::size_t received_ = 0;
  std::shared_ptr<StreamPump<FakeStream>> session_ = std::make_shared<StreamPump<FakeStream>>(
      FakeStream(io_, wire_), [this](View bytes) { received_ += bytes.size(); },
      [this](const std::error_code& error) { ends_.push_back(error); });
};

TEST_F(SessionTest, WritesInPiecesAsThereIsRoom) {
  session_->Send(ToBytes("first"));
  session_->Send(ToBytes("second"));
  EXPECT_TRUE(wire_->written.empty());
  MakeRoom(3);
  MakeRoom(4);
  EXPECT_EQ(AsText(wire_->written), "firstse");
  EXPECT_EQ(session_->taken(), 7U);
  MakeRoom(100);
  EXPECT_EQ(AsText(wire_->written), "firstsecond");
  EXPECT_EQ(session_->taken(), 11U);
  session_->Send(ToBytes("third"));
  EXPECT_EQ(AsText(wire_->written), "firstsecondthird") << "at once";
}

TEST_F(SessionTest, DroppedBytesAreNeverWritten) {
  session_->Send(ToBytes("start"));
  session_->Send(ToBytes("more"));
  EXPECT_TRUE(session_->DropUnsent());
  EXPECT_FALSE(session_->DropUnsent()) << "nothing is left";
  MakeRoom(100);
  EXPECT_EQ(AsText(wire_->written), "");
  session_->Send(ToBytes("stop"));
  EXPECT_EQ(AsText(wire_->written), "stop");
}

TEST_F(SessionTest, TheRestOfAPartlyWrittenRequestIsDropped) {
  wire_->room = 2;
  session_->Send(ToBytes("start"));
  EXPECT_TRUE(session_->DropUnsent());
  EXPECT_EQ(session_->taken(), 2U);
  session_->Send(ToBytes("stop"));
  EXPECT_EQ(AsText(wire_->written), "st") << "there is no room yet";
  MakeRoom(100);
  EXPECT_EQ(AsText(wire_->written), "ststop");
  EXPECT_TRUE(ends_.empty());
}

/// The stream behaves like a pty after TCOFLUSH: it has room, but does not report that it has room.
TEST_F(SessionTest, RoomWithoutANotificationIsUsed) {
  session_->Send(ToBytes("start"));
  session_->DropUnsent();
  wire_->room = 100;
  session_->Send(ToBytes("stop"));
  EXPECT_EQ(AsText(wire_->written), "stop");
  EXPECT_TRUE(wire_->waiting);
}

TEST_F(SessionTest, WrittenBytesAreNotDropped) {
  wire_->room = 100;
  session_->Send(ToBytes("request"));
  EXPECT_FALSE(session_->DropUnsent());
  EXPECT_EQ(AsText(wire_->written), "request");
}

class DyingPort : public SessionTest, public testing::WithParamInterface<std::error_code> {};

TEST_P(DyingPort, IsLostByReading) {
  wire_->reading({}, 3);
  EXPECT_EQ(received_, 3U);
  std::exchange(wire_->reading, {})(GetParam(), 0);
  ASSERT_EQ(ends_.size(), 1U);
  EXPECT_EQ(ends_[0], GetParam());
  EXPECT_FALSE(wire_->reading) << "a dead tty is readable for ever";
}

TEST_P(DyingPort, IsLostByWriting) {
  wire_->room = 100;
  wire_->write_error = GetParam();
  session_->Send(ToBytes("request"));
  EXPECT_TRUE(ends_.empty()) << "no callback from within the call";
  test::RunReady(io_);
  ASSERT_EQ(ends_.size(), 1U);
  EXPECT_EQ(ends_[0], GetParam());
  std::exchange(wire_->reading, {})(GetParam(), 0);
  EXPECT_EQ(ends_.size(), 1U) << "told once";
  wire_->write_error.clear();
  session_->Send(ToBytes("more"));
  EXPECT_TRUE(wire_->written.empty());
}

TEST_P(DyingPort, IsLostByWaitingForRoom) {
  session_->Send(ToBytes("request"));
  ASSERT_TRUE(wire_->waiting);
  std::exchange(wire_->waiting, {})(GetParam());
  ASSERT_EQ(ends_.size(), 1U);
  EXPECT_EQ(ends_[0], GetParam());
}

/// asio reports a read of 0 bytes as end of file.
INSTANTIATE_TEST_SUITE_P(Errors, DyingPort,
                         testing::Values(std::error_code(asio::error::eof),
                                         std::error_code(EIO, std::system_category()),
                                         std::error_code(ENODEV, std::system_category()),
                                         std::error_code(ENXIO, std::system_category())));

struct Pipe {
  Pipe() {
    int ends[2] = {-1, -1};
    EXPECT_EQ(pipe(ends), 0);
    reading = ends[0];
    writing = ends[1];
  }
  ~Pipe() { close(reading); }
  bool SeesEnd() const {
    char byte = 0;
    return read(reading, &byte, 1) == 0;
  }
  int reading = -1;
  int writing = -1;
};

/// A TCP connection whose close() blocks, because the peer does not read.
struct Stuck {
  Stuck() {
    const int listener = socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* generic = reinterpret_cast<sockaddr*>(&address);
    EXPECT_EQ(bind(listener, generic, size), 0);
    EXPECT_EQ(listen(listener, 1), 0);
    EXPECT_EQ(getsockname(listener, generic, &size), 0);
    fd = socket(AF_INET, SOCK_STREAM, 0);
    EXPECT_EQ(connect(fd, generic, size), 0);
    peer = accept(listener, nullptr, nullptr);
    close(listener);
    const linger wait{1, 120};
    EXPECT_EQ(setsockopt(fd, SOL_SOCKET, SO_LINGER, &wait, sizeof wait), 0);
    EXPECT_EQ(fcntl(fd, F_SETFL, O_NONBLOCK), 0);
    const std::vector<char> much(65536);
    while (write(fd, much.data(), much.size()) > 0) {
    }
  }
  int fd = -1;
  int peer = -1;
};

TEST(CloseElsewhere, ClosesEveryDescriptor) {
  const std::vector<Pipe> pipes(5 * kMostClosers);
  for (const Pipe& one : pipes) CloseElsewhere(one.writing);
  for (const Pipe& one : pipes) EXPECT_TRUE(one.SeesEnd());
}

TEST(CloseElsewhere, AStuckCloseDoesNotBlockOthers) {
  const Stuck stuck;
  CloseElsewhere(stuck.fd);
  const Pipe other;
  CloseElsewhere(other.writing);
  EXPECT_TRUE(other.SeesEnd());
  close(stuck.peer);
}

TEST(CloseElsewhere, WaitsForAThreadWhenAllAreStuck) {
  const std::vector<Stuck> stuck(kMostClosers);
  for (const Stuck& one : stuck) CloseElsewhere(one.fd);
  const Pipe other;
  CloseElsewhere(other.writing);
  close(stuck.front().peer);
  EXPECT_TRUE(other.SeesEnd());
  for (std::size_t i = 1; i < stuck.size(); ++i) close(stuck[i].peer);
}

using asio::ip::tcp;
/// Binds to an address that the machine does not have, as if the address had been removed.
using FreeBind = asio::detail::socket_option::boolean<IPPROTO_IP, IP_FREEBIND>;

std::string TroubleAt(const char* address) {
  asio::io_context io;
  const tcp::endpoint at(asio::ip::make_address(address), 0);
  tcp::acceptor acceptor(io, at.protocol());
  if (at.address().is_v4()) acceptor.set_option(FreeBind(true));
  acceptor.bind(at);
  acceptor.listen();
  const Status has = HasAddressOf(acceptor);
  return has ? "" : has.error();
}

TEST(ListenSocket, NamesAnAddressThatTheMachineLacks) {
  for (const char* here : {"127.0.0.1", "127.0.0.7", "0.0.0.0", "::"}) {
    EXPECT_EQ(TroubleAt(here), "") << here;
  }
  EXPECT_EQ(TroubleAt("192.0.2.9"),
            "this machine does not have the address 192.0.2.9 now ('ip addr' lists its addresses); "
            "clients can connect again when the address is back");
}

TEST(MakeTransport, TheFormOfThePortSelectsTheTransport) {
  asio::io_context io;
  test::Recorder listener;
  config::Line line;
  line.port = "/dev/ttyUSB0";
  EXPECT_EQ(MakeTransport(line, io, listener)->Describe(), "serial /dev/ttyUSB0 9600 8N1");
  line.port = "tcp://[::1]:4001";
  EXPECT_EQ(MakeTransport(line, io, listener)->Describe(), "tcp://[::1]:4001");
}

}  // namespace
}  // namespace baudgate::transports
