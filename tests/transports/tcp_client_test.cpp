// Tests the TCP transport with a serial server on the loopback interface.
// SPDX-License-Identifier: Apache-2.0
#include "transports/tcp_client.h"

#include <gtest/gtest.h>
#include <linux/sockios.h>
#include <netinet/tcp.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <asio/executor_work_guard.hpp>
#include <asio/ip/tcp.hpp>
#include <asio/post.hpp>
#include <atomic>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/text.h"
#include "tests/transports/far_end.h"

namespace baudgate::transports {
namespace {

using asio::ip::tcp;
using FarServer = test::FarEnd<tcp::socket>;

class TcpClientTest : public testing::Test {
 protected:
  TcpClientTest() { Listen(0); }

  void Listen(std::uint16_t port) {
    acceptor_.emplace(io_, tcp::endpoint(asio::ip::address_v4::loopback(), port));
    number_ = acceptor_->local_endpoint().port();
    Accept();
  }
  void Accept() {
    acceptor_->async_accept([this](const std::error_code& error, tcp::socket socket) {
      if (error) return;
      far_.emplace(std::move(socket));
      if (!stalled_) far_->Start();
      ++accepted_;
      Accept();
    });
  }
  std::string Address(const std::string& host = "127.0.0.1") const {
    return "tcp://" + host + ":" + std::to_string(number_);
  }
  void Make(const std::string& address) {
    client_ = MakeTcpClient(address, serial_, {}, io_, listener_);
  }
  void Open() {
    if (!client_) Make(Address());
    const int before = listener_.opened;
    const int accepted_before = accepted_;
    client_->Open();
    EXPECT_EQ(listener_.opened, before) << "no callback from within the call";
    ASSERT_TRUE(test::RunUntil(
        io_, [&] { return listener_.opened > before && accepted_ > accepted_before; }));
    EXPECT_TRUE(client_->is_open());
  }
  bool WaitForLoss() {
    return test::RunUntil(io_, [&] { return !listener_.losses.empty(); });
  }
  bool WaitForFailure() {
    return test::RunUntil(io_, [&] { return !listener_.failures.empty(); });
  }

  asio::io_context io_;
  config::SerialSettings serial_;
  test::Recorder listener_;
  std::optional<tcp::acceptor> acceptor_;
  std::uint16_t number_ = 0;
  int accepted_ = 0;
  bool stalled_ = false;
  std::optional<FarServer> far_;
  std::unique_ptr<Transport> client_;
};

TEST_F(TcpClientTest, CarriesEveryByteBothWays) {
  Open();
  client_->Send(test::AllBytes());
  EXPECT_TRUE(test::RunUntil(io_, [&] { return far_->received().size() >= 256; }));
  EXPECT_EQ(far_->received(), test::AllBytes());
  far_->Write(test::AllBytes());
  EXPECT_TRUE(test::RunUntil(io_, [&] { return listener_.received.size() >= 256; }));
  EXPECT_EQ(listener_.received, test::AllBytes());
}

TEST_F(TcpClientTest, ResolvesNames) {
  Make(Address("localhost"));
  Open();
}

TEST_F(TcpClientTest, UnknownNameIsAFailure) {
  // The name has an empty label, so the resolver refuses it without a network request.
  Make("tcp://no..such..host:4001");
  client_->Open();
  ASSERT_TRUE(WaitForFailure());
  EXPECT_NE(listener_.failures[0].find("tcp://no..such..host:4001 is not known"),
            std::string::npos);
}

TEST_F(TcpClientTest, RefusedConnectionIsAFailureAndLaterWorks) {
  acceptor_.reset();
  Make(Address());
  client_->Open();
  ASSERT_TRUE(WaitForFailure());
  EXPECT_NE(listener_.failures[0].find(Address() + ": Connection refused"), std::string::npos)
      << listener_.failures[0];
  EXPECT_FALSE(client_->is_open());
  Listen(number_);
  Open();
  EXPECT_EQ(listener_.failures.size(), 1U);
}

TEST_F(TcpClientTest, ACloseByTheServerIsReportedOnce) {
  Open();
  far_->stream().close();
  ASSERT_TRUE(WaitForLoss());
  test::RunReady(io_);
  EXPECT_EQ(listener_.losses, std::vector{Address() + " closed the connection"});
  EXPECT_FALSE(client_->is_open());
  Open();
}

TEST_F(TcpClientTest, AResetByTheServerIsALoss) {
  Open();
  far_->stream().set_option(asio::socket_base::linger(true, 0));
  far_->stream().close();
  ASSERT_TRUE(WaitForLoss());
  EXPECT_EQ(listener_.losses, std::vector{Address() + " reset the connection"});
}

TEST_F(TcpClientTest, CloseAndOpenCyclesAreClean) {
  for (int round = 1; round <= 10; ++round) {
    Open();
    FarServer first = *far_;
    client_->Close();
    EXPECT_FALSE(client_->is_open());
    EXPECT_TRUE(test::RunUntil(io_, [&] { return first.ended(); })) << "the server sees the end";
    // After an orderly close the kernel would still send the bytes that it holds.
    EXPECT_EQ(first.end(), asio::error::connection_reset);
  }
  EXPECT_TRUE(listener_.losses.empty());
  EXPECT_TRUE(listener_.failures.empty());
}

TEST_F(TcpClientTest, CloseCancelsOpenAtEveryStage) {
  Make(Address("localhost"));
  for (int steps = 0; steps < 4; ++steps) {
    client_->Open();
    for (int i = 0; i < steps; ++i) io_.poll_one();
    if (client_->is_open()) break;
    client_->Close();
    const int opened = listener_.opened;
    test::RunReady(io_);
    EXPECT_EQ(listener_.opened, opened);
  }
  client_->Open();
  client_.reset();
  const int opened = listener_.opened;
  test::RunReady(io_);
  EXPECT_EQ(listener_.opened, opened);
  EXPECT_TRUE(listener_.failures.empty());
}

TEST_F(TcpClientTest, UnreadableAddressFailsTheOpen) {
  Make("tcp://host");
  client_->Open();
  EXPECT_TRUE(listener_.failures.empty()) << "no callback from within the call";
  ASSERT_TRUE(WaitForFailure());
  EXPECT_NE(listener_.failures[0].find("the port number is missing"), std::string::npos);
}

TEST_F(TcpClientTest, MayBeDestroyedFromACallback) {
  Open();
  listener_.on_lost = [&] { client_.reset(); };
  far_->stream().close();
  ASSERT_TRUE(WaitForLoss());
  test::RunReady(io_);
  EXPECT_EQ(client_, nullptr);
}

TEST_F(TcpClientTest, SoftwareParityWorksThroughAServer) {
  serial_.data_bits = 7;
  serial_.parity = config::Parity::odd;
  serial_.software_parity = true;
  Open();
  client_->Send(ToBytes("A"));
  ASSERT_TRUE(test::RunUntil(io_, [&] { return !far_->received().empty(); }));
  EXPECT_EQ(far_->received(), Bytes{0xC1});
  far_->Write({0xC1, 0x41});
  ASSERT_TRUE(test::RunUntil(io_, [&] { return listener_.received.size() >= 2; }));
  EXPECT_EQ(client_->Counters().parity, 1U);
}

TEST_F(TcpClientTest, SerialSettingsCannotBeChangedThroughAServer) {
  Open();
  EXPECT_TRUE(client_->Apply(serial_).ok());
  config::SerialSettings other = serial_;
  other.baud = 19200;
  const Status applied = client_->Apply(other);
  ASSERT_FALSE(applied.ok());
  EXPECT_NE(applied.error().find("serial server"), std::string::npos);
}

int ClientDescriptor(std::uint16_t server_port) {
  for (int fd = 3; fd < 256; ++fd) {
    sockaddr_in peer{};
    socklen_t size = sizeof peer;
    if (getpeername(fd, reinterpret_cast<sockaddr*>(&peer), &size) == 0 &&
        ntohs(peer.sin_port) == server_port) {
      return fd;
    }
  }
  return -1;
}

int Queued(int fd, unsigned long which) {
  int count = 0;
  EXPECT_EQ(ioctl(fd, which, &count), 0);
  return count;
}

/// The connection to a server that reads nothing is filled with more bytes than the kernels accept.
class StalledServer : public TcpClientTest {
 protected:
  StalledServer() {
    stalled_ = true;
    Open();
    const int fd = ClientDescriptor(number_);
    const Bytes piece(40'000, 'x');
    for (int i = 0; i < 100 && Queued(fd, SIOCOUTQNSD) < 100'000; ++i) {
      client_->Send(piece);
      given_ += piece.size();
      test::RunReady(io_);
    }
    EXPECT_GE(Queued(fd, SIOCOUTQNSD), 100'000);
    EXPECT_TRUE(listener_.losses.empty());
  }
  std::size_t ReadOfFirst(FarServer& first) {
    first.Start();
    EXPECT_TRUE(test::RunUntil(io_, [&] { return first.ended(); }));
    EXPECT_EQ(first.end(), asio::error::connection_reset);
    return first.received().size();
  }
  std::size_t given_ = 0;
};

TEST_F(StalledServer, GetsNoMoreBytesOfAnAbandonedRequest) {
  FarServer first = *far_;
  client_->DropUnsent();
  EXPECT_TRUE(listener_.losses.empty()) << "no callback from within the call";
  ASSERT_TRUE(WaitForLoss());
  test::RunReady(io_);
  ASSERT_EQ(listener_.losses.size(), 1U);
  EXPECT_EQ(listener_.losses[0], Address() +
                                     " takes no data, so the gateway gives up a request that was "
                                     "not acknowledged");
  EXPECT_FALSE(client_->is_open());
  EXPECT_LE(ReadOfFirst(first), given_ - 100'000);

  stalled_ = false;
  Open();
  client_->Send(ToBytes("stop"));
  ASSERT_TRUE(test::RunUntil(io_, [&] { return far_->received().size() >= 4; }));
  EXPECT_EQ(AsText(far_->received()), "stop");
}

TEST_F(StalledServer, GetsNoMoreBytesAfterClosing) {
  FarServer first = *far_;
  client_->Close();
  EXPECT_LE(ReadOfFirst(first), given_ - 100'000);
  EXPECT_TRUE(listener_.losses.empty());
}

TEST_F(StalledServer, GetsNoMoreBytesWhenTheTransportIsDestroyed) {
  FarServer first = *far_;
  client_.reset();
  EXPECT_LE(ReadOfFirst(first), given_ - 100'000);
}

TEST_F(StalledServer, ClosingEndsTheWaitForItsAcknowledgement) {
  client_->DropUnsent();
  client_->Close();
  Open();
  test::RunReady(io_);
  EXPECT_TRUE(listener_.losses.empty());
  EXPECT_TRUE(client_->is_open()) << "the new connection has nothing to do with it";
  client_->DropUnsent();
  client_.reset();
  test::RunReady(io_);
}

TEST_F(StalledServer, IsDrainedWhenTheServerHasTakenAll) {
  EXPECT_FALSE(client_->IsDrained());
  far_->Start();
  ASSERT_TRUE(test::RunUntil(io_, [&] { return far_->received().size() >= given_; }));
  for (int i = 0; i < 1000 && !client_->IsDrained(); ++i) test::RunReady(io_);
  EXPECT_TRUE(client_->IsDrained());
  ASSERT_TRUE(client_->Reset(serial_).ok());
  test::RunReady(io_);
  EXPECT_TRUE(client_->is_open());
}

/// The server's kernel acknowledges the request, at once or later, although the device is silent.
TEST_F(TcpClientTest, AServerThatHasReceivedTheRequestKeepsItsConnection) {
  Open();
  const int fd = ClientDescriptor(number_);
  for (int round = 1; round <= 20; ++round) {
    client_->Send(ToBytes("request"));
    client_->DropUnsent();
    const std::size_t expected = static_cast<std::size_t>(round) * 7;
    ASSERT_TRUE(test::RunUntil(io_, [&] { return far_->received().size() >= expected; }));
  }
  while (Queued(fd, SIOCOUTQ) > 0) io_.poll();
  client_->DropUnsent();
  far_->Write(ToBytes("reply"));
  ASSERT_TRUE(test::RunUntil(io_, [&] { return listener_.received.size() >= 5; }));
  EXPECT_TRUE(listener_.losses.empty());
  EXPECT_EQ(accepted_, 1);
}

TEST_F(TcpClientTest, ADeadPeerIsNoticedWithinSeconds) {
  Open();
  const int fd = ClientDescriptor(number_);
  ASSERT_GE(fd, 0);
  const auto option = [fd](int level, int name) {
    int value = 0;
    socklen_t size = sizeof value;
    EXPECT_EQ(getsockopt(fd, level, name, &value, &size), 0);
    return value;
  };
  EXPECT_NE(option(IPPROTO_TCP, TCP_NODELAY), 0);
  EXPECT_NE(option(SOL_SOCKET, SO_KEEPALIVE), 0);
  EXPECT_EQ(option(IPPROTO_TCP, TCP_KEEPIDLE), 10);
  EXPECT_EQ(option(IPPROTO_TCP, TCP_KEEPINTVL), 5);
  EXPECT_EQ(option(IPPROTO_TCP, TCP_KEEPCNT), 3);
  EXPECT_EQ(option(IPPROTO_TCP, TCP_USER_TIMEOUT), 15'000);
}

void ExpectAddress(const char* text, const char* host, int port) {
  const auto address = ParseTcpPort(text);
  ASSERT_TRUE(address.ok()) << address.error();
  EXPECT_EQ(address->host, host);
  EXPECT_EQ(address->port, port);
}

TEST(TcpAddress, NamesAndAddressesAreAccepted) {
  ExpectAddress("tcp://moxa-7.local:4001", "moxa-7.local", 4001);
  ExpectAddress("tcp://192.0.2.7:1", "192.0.2.7", 1);
  ExpectAddress("tcp://[::1]:4001", "::1", 4001);
  ExpectAddress("tcp://[fe80::1%eth0]:65535", "fe80::1%eth0", 65535);
}

TEST(TcpAddress, WrongAddressesAreErrorsThatNameThem) {
  for (const std::string_view text :
       Split("|/dev/ttyUSB0|tcp:/host:1|tcp://|tcp://host|tcp://host:|tcp://:4001|"
             "tcp://host:0|tcp://host:65536|tcp://host:-1|tcp://host:+1|tcp://host:4001/|"
             "tcp://host: 4001|tcp://::1:4001|tcp://[::1]|tcp://[::1]4001|tcp://[::1:4001|"
             "tcp://[]:4001|tcp://[host]:4001|tcp://user@host:4001|tcp://a b:4001",
             '|')) {
    const auto address = ParseTcpPort(text);
    ASSERT_FALSE(address.ok()) << text;
    EXPECT_NE(address.error().find(text), std::string::npos);
  }
}

TEST(TcpAddress, OnlyTheSchemeMakesATcpPort) {
  EXPECT_TRUE(config::IsNetworkPort("tcp://wrong"));
  EXPECT_FALSE(config::IsNetworkPort("/dev/serial/by-id/tcp://"));
}

/// A name server that does not answer for hosts named "dead…" until `revive` is set.
struct NameServer {
  std::promise<void> revive;
  std::shared_future<void> revived = revive.get_future().share();
  std::atomic<int> asked = 0;
  std::atomic<int> asked_dead = 0;
};

class NamesTest : public testing::Test {
 protected:
  ~NamesTest() override {
    tickets_.clear();
    server_->revive.set_value();
  }
  void Ask(const std::string& host) {
    tickets_.push_back(names_.Ask(host, io_, [this](const Result<HostNames::Addresses>& found) {
      answers_ += found ? 1 : 100;
    }));
  }
  bool WaitFor(const std::function<bool()>& condition) { return test::RunUntil(io_, condition); }
  bool WaitForAsked(int dead) {
    // A look-up runs in another thread, which does not wake this loop.
    return WaitFor([&] {
      asio::post(io_, [] {});
      return server_->asked_dead >= dead;
    });
  }

  asio::io_context io_;
  asio::executor_work_guard<asio::io_context::executor_type> work_{io_.get_executor()};
  std::shared_ptr<NameServer> server_ = std::make_shared<NameServer>();
  HostNames names_{[server = server_](const std::string& host) -> Result<HostNames::Addresses> {
    ++server->asked;
    if (host.starts_with("dead")) {
      ++server->asked_dead;
      server->revived.wait();
      return Error{"no answer"};
    }
    if (host == "unknown") return Error{"not known"};
    return HostNames::Addresses{asio::ip::address_v4::loopback()};
  }};
  int answers_ = 0;
  std::vector<HostNames::Ticket> tickets_;
};

TEST_F(NamesTest, AnAnswerComesOnTheLoopOfTheCaller) {
  Ask("server");
  EXPECT_EQ(answers_, 0) << "never from within the call";
  EXPECT_TRUE(WaitFor([&] { return answers_ == 1; }));
  Ask("unknown");
  EXPECT_TRUE(WaitFor([&] { return answers_ == 101; }));
}

TEST_F(NamesTest, ADroppedTicketIsNotAnswered) {
  Ask("dropped");
  tickets_.clear();
  Ask("server");
  EXPECT_TRUE(WaitFor([&] { return answers_ > 0; }));
  test::RunReady(io_);
  EXPECT_EQ(answers_, 1);
}

TEST_F(NamesTest, AHostIsLookedUpOnceForAllCallers) {
  for (int i = 0; i < 1000; ++i) Ask("dead");
  Ask("server");
  EXPECT_TRUE(WaitFor([&] { return answers_ == 1; }));
  EXPECT_TRUE(WaitForAsked(1));
  EXPECT_EQ(server_->asked, 2);
}

/// A line gives up a look-up after 5 s. Until then, its look-up occupies one of kMostAwaited
/// places.
TEST_F(NamesTest, AbandonedHostsMakeRoom) {
  for (std::size_t i = 0; i < HostNames::kMostAwaited; ++i) Ask("dead" + std::to_string(i));
  ASSERT_TRUE(WaitForAsked(HostNames::kMostAwaited));
  std::vector<HostNames::Ticket> impatient;
  impatient.swap(tickets_);
  Ask("server");
  test::RunReady(io_);
  EXPECT_EQ(answers_, 0);
  impatient.pop_back();
  EXPECT_TRUE(WaitFor([&] { return answers_ == 1; }));
}

TEST_F(NamesTest, HostsThatHangTakeBoundedThreads) {
  constexpr std::size_t kMost = HostNames::kMostAwaited + HostNames::kMostHanging;
  for (std::size_t i = 0; i < kMost; ++i) {
    Ask("dead" + std::to_string(i));
    ASSERT_TRUE(WaitForAsked(static_cast<int>(i + 1)));
    if (i < HostNames::kMostHanging) tickets_.clear();
  }
  Ask("server");
  test::RunReady(io_);
  EXPECT_EQ(answers_, 0);
  EXPECT_EQ(server_->asked, static_cast<int>(kMost));
}

TEST_F(NamesTest, ADeadNameServerDelaysNoOtherLine) {
  asio::ip::tcp::acceptor acceptor(io_,
                                   asio::ip::tcp::endpoint(asio::ip::address_v4::loopback(), 0));
  const std::string port = ":" + std::to_string(acceptor.local_endpoint().port());
  test::Recorder hanging;
  test::Recorder named;
  test::Recorder numeric;
  const config::SerialSettings serial;
  const auto dead = MakeTcpClient("tcp://dead" + port, serial, {}, io_, hanging, names_);
  const auto by_name = MakeTcpClient("tcp://server" + port, serial, {}, io_, named, names_);
  const auto by_number = MakeTcpClient("tcp://127.0.0.1" + port, serial, {}, io_, numeric, names_);
  dead->Open();
  ASSERT_TRUE(WaitForAsked(1));
  by_name->Open();
  by_number->Open();
  EXPECT_TRUE(WaitFor([&] { return named.opened == 1 && numeric.opened == 1; }));
  EXPECT_EQ(hanging.opened, 0);
  EXPECT_TRUE(hanging.failures.empty());
}

TEST_F(NamesTest, ALineWhoseNameHangsCanBeClosed) {
  test::Recorder hanging;
  auto dead = MakeTcpClient("tcp://dead:1", {}, {}, io_, hanging, names_);
  dead->Open();
  ASSERT_TRUE(WaitForAsked(1));
  dead.reset();
  test::RunReady(io_);
  EXPECT_TRUE(hanging.failures.empty());
}

}  // namespace
}  // namespace baudgate::transports
