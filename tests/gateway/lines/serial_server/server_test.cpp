// Clients over real sockets: who gets the port, who is refused, who waits, and what is left behind.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/lines/serial_server/server.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <asio/read.hpp>
#include <asio/write.hpp>
#include <filesystem>

#include "gateway/base/text.h"
#include "tests/gateway/lines/serial_server/fake_port.h"
#include "tests/transports/far_end.h"

namespace baudgate::serial_server {
namespace {

using asio::ip::tcp;
using test::RunReady;
using test::RunUntil;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using Client = test::FarEnd<tcp::socket>;
using Busy = config::PortServer::Busy;

std::size_t OpenDescriptors() {
  const auto all = std::filesystem::directory_iterator("/proc/self/fd");
  return static_cast<std::size_t>(std::distance(begin(all), end(all)));
}

/// Grants the port at once, unless it says why not.
struct FakeLine final : PortOwner {
  void Want(PortUser& user, const Visit& visit, Now now) override {
    wanted.push_back(visit.client);
    if (is_down) return user.TakeBack(now);
    if (grants) user.Grant(port, {}, now);
  }
  void Return(PortUser&, const Visit& visit, const std::string& why, Now) override {
    returned.push_back(why);
    last = visit;
  }
  void OnListening(const std::string&, const std::string& its, Now) override { trouble = its; }

  test::FakePort port;
  bool grants = true;
  bool is_down = false;
  std::vector<std::string> wanted;
  std::vector<std::string> returned;
  Visit last;
  std::string trouble = "?";
};

class ServerTest : public testing::Test {
 protected:
  ServerTest() {
    config_.at = {"127.0.0.1", FreePort()};
    config_.idle = 1h;
  }
  ~ServerTest() override {
    server_.reset();
    RunReady(io_);
  }
  static std::uint16_t FreePort() {
    asio::io_context io;
    return tcp::acceptor(io, {asio::ip::address_v4::loopback(), 0}).local_endpoint().port();
  }
  void Start(Server::Use use) {
    server_ = std::make_unique<Server>(io_, config_, use, "bay-1", line_);
    server_->Start();
  }
  std::unique_ptr<Client> Connect() {
    tcp::socket socket(io_);
    socket.connect({asio::ip::address_v4::loopback(), config_.at.port});
    auto client = std::make_unique<Client>(std::move(socket));
    client->Start();
    RunReady(io_);
    return client;
  }
  bool Ends(const Client& client) {
    return RunUntil(io_, [&] { return client.ended(); });
  }
  bool Until(const std::function<bool()>& done) { return RunUntil(io_, done); }

  asio::io_context io_;
  config::PortServer config_;
  FakeLine line_;
  std::unique_ptr<Server> server_;
};

TEST_F(ServerTest, ServesOneClientAtATime) {
  Start(Server::Use::served);
  EXPECT_EQ(line_.trouble, "");
  const auto first = Connect();
  EXPECT_TRUE(Until([&] { return line_.wanted.size() == 1; }));
  first->Write({1, 2, 3});
  EXPECT_TRUE(Until([&] { return line_.port.sent.size() == 3; }));
  server_->OnPort(Bytes{4, 5}, ReadClocks());
  EXPECT_TRUE(Until([&] { return first->received().size() == 2; }));
  const auto second = Connect();
  EXPECT_TRUE(Ends(*second)) << "refused";
  EXPECT_FALSE(first->ended());
  EXPECT_EQ(line_.wanted.size(), 1U);
}

TEST_F(ServerTest, TheNextMayComeAsSoonAsTheLastHasClosed) {
  Start(Server::Use::served);
  for (int i = 0; i < 20; ++i) {
    auto client = Connect();
    EXPECT_TRUE(Until([&] { return line_.wanted.size() == static_cast<std::size_t>(i) + 1; })) << i;
    client->stream().close();
  }
  EXPECT_TRUE(Until([&] { return line_.returned.size() == 20; }));
}

TEST_F(ServerTest, AClientMayWaitForItsTurn) {
  config_.busy = Busy::wait;
  Start(Server::Use::served);
  auto first = Connect();
  const auto second = Connect();
  auto third = Connect();
  second->Write({7});
  RunReady(io_);
  EXPECT_FALSE(second->ended());
  EXPECT_THAT(line_.port.sent, IsEmpty());
  third->stream().close();  // it waits no more
  first->stream().close();
  EXPECT_TRUE(Until([&] { return line_.port.sent.size() == 1; })) << "what it has sent meanwhile";
  EXPECT_EQ(line_.wanted.size(), 2U);
}

TEST_F(ServerTest, WhatAWaitingClientHasSentBeforeItClosedIsDelivered) {
  config_.busy = Busy::wait;
  Start(Server::Use::served);
  auto first = Connect();
  auto second = Connect();
  second->Write({7, 8});
  RunReady(io_);
  second->stream().close();
  RunReady(io_);
  first->stream().close();
  EXPECT_TRUE(Until([&] { return line_.returned.size() == 2; }));
  EXPECT_THAT(line_.port.sent, ElementsAre(7, 8));
  EXPECT_EQ(line_.last.to_port, 2U);
}

TEST_F(ServerTest, NotAllMayWait) {
  config_.busy = Busy::wait;
  Start(Server::Use::served);
  std::vector<std::unique_ptr<Client>> clients;
  for (std::size_t i = 0; i < Server::kMostClients; ++i) clients.push_back(Connect());
  EXPECT_TRUE(Ends(*Connect()));
  for (const auto& client : clients) EXPECT_FALSE(client->ended());
}

TEST_F(ServerTest, LetsNobodyInWhoIsNotAllowed) {
  config_.allow = {*config::ParseNetwork("192.0.2.0/24")};
  Start(Server::Use::served);
  EXPECT_TRUE(Ends(*Connect()));
  EXPECT_THAT(line_.wanted, IsEmpty());
}

TEST_F(ServerTest, AClientIsDisconnectedWhereThePortIsDown) {
  line_.is_down = true;
  Start(Server::Use::served);
  EXPECT_TRUE(Ends(*Connect()));
  EXPECT_THAT(line_.returned, IsEmpty());
}

TEST_F(ServerTest, ALentPortIsTakenByTheFirstByteAlone) {
  Start(Server::Use::lent);
  const auto silent = Connect();
  const auto another = Connect();
  RunReady(io_);
  EXPECT_THAT(line_.wanted, IsEmpty());
  another->Write({1});
  EXPECT_TRUE(Until([&] { return line_.port.sent.size() == 1; }));
  silent->Write({2});
  EXPECT_TRUE(Ends(*silent));
  EXPECT_TRUE(Ends(*Connect())) << "while it is in use";
  EXPECT_THAT(line_.port.sent, ElementsAre(1));
}

TEST_F(ServerTest, SilentClientsDoNotKeepOthersFromALentPort) {
  Start(Server::Use::lent);
  std::vector<std::unique_ptr<Client>> silent;
  for (std::size_t i = 0; i < Server::kMostClients; ++i) silent.push_back(Connect());
  const auto newcomer = Connect();
  EXPECT_TRUE(Ends(*silent[0])) << "the oldest";
  newcomer->Write({1});
  EXPECT_TRUE(Until([&] { return line_.port.sent.size() == 1; }));
  EXPECT_FALSE(silent[1]->ended());
}

TEST_F(ServerTest, WaitsForTheExchangeUnderWay) {
  line_.grants = false;
  Start(Server::Use::lent);
  auto client = Connect();
  client->Write({1});
  EXPECT_TRUE(Until([&] { return line_.wanted.size() == 1; }));
  client->Write({2, 3});
  RunReady(io_);
  EXPECT_THAT(line_.port.sent, IsEmpty());
  server_->Grant(line_.port, {}, ReadClocks());
  EXPECT_TRUE(Until([&] { return line_.port.sent.size() == 3; }));
  server_->TakeBack(ReadClocks());
  EXPECT_TRUE(Ends(*client));
  EXPECT_THAT(line_.returned, IsEmpty());
}

TEST_F(ServerTest, TellsWhoHasLeft) {
  Start(Server::Use::lent);
  auto client = Connect();
  client->Write({1, 2});
  EXPECT_TRUE(Until([&] { return line_.port.sent.size() == 2; }));
  server_->OnPort(Bytes{4}, ReadClocks());
  client->stream().close();
  EXPECT_TRUE(Until([&] { return !line_.returned.empty(); }));
  EXPECT_THAT(line_.returned, ElementsAre("it has left"));
  EXPECT_THAT(line_.last.client, HasSubstr("127.0.0.1:"));
  EXPECT_EQ(line_.last.to_port, 2U);
  EXPECT_EQ(line_.last.from_port, 1U);
}

TEST_F(ServerTest, AnIdleClientLosesThePort) {
  config_.idle = 1ms;
  Start(Server::Use::served);
  const auto client = Connect();
  EXPECT_TRUE(Ends(*client));
  EXPECT_THAT(line_.returned, ElementsAre(HasSubstr("nothing was said")));
}

TEST_F(ServerTest, TriesAgainWhereItsPortIsTaken) {
  tcp::acceptor other(io_, {asio::ip::address_v4::loopback(), config_.at.port});
  Start(Server::Use::served);
  EXPECT_THAT(line_.trouble, HasSubstr("already in use"));
  other.close();
  EXPECT_TRUE(Until([&] { return line_.trouble.empty(); }));
}

TEST_F(ServerTest, ClientsThatComeAndGoLeaveNothingOpen) {
  config_.busy = Busy::wait;
  for (const auto use : {Server::Use::served, Server::Use::lent}) {
    Start(use);
    const std::size_t before = OpenDescriptors();
    for (int i = 0; i < 200; ++i) {
      std::vector<std::unique_ptr<Client>> clients;
      for (int other = 0; other < i % 4; ++other) clients.push_back(Connect());
      if (i % 3 == 0 && !clients.empty()) clients.back()->Write(Bytes(static_cast<std::size_t>(i)));
      if (i % 5 == 0) RunReady(io_);
      if (i % 7 == 0) server_->TakeBack(ReadClocks());
      for (const auto& client : clients) client->stream().close();
    }
    EXPECT_TRUE(Until([&] { return OpenDescriptors() == before; }));
    server_.reset();
    RunReady(io_);
  }
}

}  // namespace
}  // namespace baudgate::serial_server
