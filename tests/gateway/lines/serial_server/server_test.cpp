// Tests of clients over real sockets: which client gets the port, waits, or is refused.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/lines/serial_server/server.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <asio/read.hpp>
#include <asio/write.hpp>
#include <filesystem>

#include "gateway/base/text.h"
#include "gateway/lines/serial_server/session.h"
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
  void OnArrival(const Arrival& arrival, Now) override { arrivals.push_back(arrival); }

  test::FakePort port;
  bool grants = true;
  bool is_down = false;
  std::vector<std::string> wanted;
  std::vector<std::string> returned;
  std::vector<Arrival> arrivals;
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
  ASSERT_EQ(line_.arrivals.size(), 1U) << "the client that was not refused";
  EXPECT_TRUE(line_.arrivals[0].peer.starts_with("127.0.0.1:"));
  EXPECT_FALSE(line_.arrivals[0].has_tls);
}

TEST_F(ServerTest, TheNextClientMayConnectWhenTheLastHasClosed) {
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
  first->Write({6});
  EXPECT_TRUE(Until([&] { return line_.port.sent.size() == 1; }));
  const auto second = Connect();
  auto third = Connect();
  second->Write({7});
  RunReady(io_);
  EXPECT_FALSE(second->ended());
  EXPECT_THAT(line_.port.sent, ElementsAre(6));
  third->stream().close();
  first->stream().close();
  EXPECT_TRUE(Until([&] { return line_.port.sent.size() == 2; })) << "what it has sent meanwhile";
  EXPECT_EQ(line_.wanted.size(), 2U);
}

TEST_F(ServerTest, ASilentClientDoesNotKeepThePortFromAClientThatSends) {
  Start(Server::Use::served);
  const auto silent = Connect();
  EXPECT_TRUE(Until([&] { return line_.wanted.size() == 1; }));
  const auto other = Connect();
  const auto second = Connect();
  RunReady(io_);
  EXPECT_FALSE(silent->ended()) << "it may read";
  second->Write({7});
  EXPECT_TRUE(Until([&] { return line_.port.sent.size() == 1; }));
  EXPECT_TRUE(Ends(*silent));
  EXPECT_TRUE(Ends(*other)) << "the port is in use";
  EXPECT_FALSE(second->ended());
  EXPECT_TRUE(Ends(*Connect()));
}

TEST_F(ServerTest, BytesOfAWaitingClientThatHasClosedAreDelivered) {
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

TEST_F(ServerTest, TheNumberOfWaitingClientsIsLimited) {
  config_.busy = Busy::wait;
  Start(Server::Use::served);
  std::vector<std::unique_ptr<Client>> clients;
  for (std::size_t i = 0; i < Server::kMostClients; ++i) {
    clients.push_back(Connect());
    clients.back()->Write({7});
  }
  RunReady(io_);
  EXPECT_TRUE(Ends(*Connect()));
  for (const auto& client : clients) EXPECT_FALSE(client->ended());
}

TEST_F(ServerTest, RefusesClientsThatAreNotAllowed) {
  config_.allow = {*config::ParseNetwork("192.0.2.0/24")};
  Start(Server::Use::served);
  EXPECT_TRUE(Ends(*Connect()));
  EXPECT_THAT(line_.wanted, IsEmpty());
}

TEST_F(ServerTest, AClientIsDisconnectedWhenThePortIsDown) {
  line_.is_down = true;
  Start(Server::Use::served);
  EXPECT_TRUE(Ends(*Connect()));
  EXPECT_THAT(line_.returned, IsEmpty());
}

TEST_F(ServerTest, ALentPortIsTakenOnlyByTheFirstByte) {
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

TEST_F(ServerTest, AClientWaitsForTheExchangeUnderWay) {
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

TEST_F(ServerTest, ReportsAClientThatHasLeftAndItsBytes) {
  Start(Server::Use::lent);
  auto client = Connect();
  client->Write({1, 2});
  EXPECT_TRUE(Until([&] { return line_.port.sent.size() == 2; }));
  server_->OnPort(Bytes{4}, ReadClocks());
  client->stream().close();
  EXPECT_TRUE(Until([&] { return !line_.returned.empty(); }));
  EXPECT_THAT(line_.returned, ElementsAre("it disconnected"));
  EXPECT_THAT(line_.last.client, HasSubstr("127.0.0.1:"));
  EXPECT_EQ(line_.last.to_port, 2U);
  EXPECT_EQ(line_.last.from_port, 1U);
}

TEST_F(ServerTest, AnIdleClientLosesThePort) {
  config_.idle = 1ms;
  Start(Server::Use::served);
  const auto client = Connect();
  EXPECT_TRUE(Ends(*client));
  EXPECT_THAT(line_.returned, ElementsAre(HasSubstr("no bytes passed")));
}

TEST_F(ServerTest, TriesAgainWhenItsTcpPortIsInUse) {
  tcp::acceptor other(io_, {asio::ip::address_v4::loopback(), config_.at.port});
  Start(Server::Use::served);
  EXPECT_THAT(line_.trouble, HasSubstr("already in use"));
  other.close();
  EXPECT_TRUE(Until([&] { return line_.trouble.empty(); }));
}

TEST_F(ServerTest, ClientsThatComeAndGoLeaveNoDescriptorOpen) {
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

using Mode = config::PortServer::Mode;

constexpr Duration kIdle = 1min;

struct FakeConnection final : Session::Connection {
  void Send(View bytes) override {
    Append(sent, bytes);
    if (!reads) held += bytes.size();
  }
  std::size_t unsent() const override { return held; }
  void Pause(bool on) override { paused = on; }

  Bytes sent;
  bool reads = true;
  std::size_t held = 0;
  bool paused = false;
};

class SessionTest : public testing::Test {
 protected:
  explicit SessionTest(Mode mode = Mode::raw)
      : session_({.mode = mode, .began = now_}, kIdle, "baudgate", client_) {}

  void Begin() { session_.Begin(port_, {}, now_); }
  void FromClient(const Bytes& bytes) { session_.OnClient(bytes, now_); }
  void FromPort(const Bytes& bytes) { session_.OnPort(bytes, now_); }
  void Pass(Duration time) {
    const Instant until = now_.instant + time;
    while (!session_.over() && session_.Deadline() <= until) {
      now_.instant = std::max(now_.instant, *session_.Deadline());
      session_.OnTimer(now_);
    }
    now_.instant = until;
  }
  std::string over() const { return session_.over().value_or(""); }

  test::FakePort port_;
  FakeConnection client_;
  Now now_{Instant() + 1h, {}};
  Session session_;
};

struct Rfc2217 : SessionTest {
  Rfc2217() : SessionTest(Mode::rfc2217) { client_.sent.clear(); }
};

TEST_F(SessionTest, RequestsThePortWithTheFirstByte) {
  EXPECT_FALSE(session_.asks());
  FromClient({1, 2});
  EXPECT_TRUE(session_.asks());
  EXPECT_TRUE(client_.paused) << "what it sends before it has the port is bounded";
  Begin();
  EXPECT_THAT(port_.sent, ElementsAre(1, 2));
  EXPECT_FALSE(client_.paused);
}

TEST_F(SessionTest, PassesEveryByteUnchanged) {
  Begin();
  Bytes all(256);
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::uint8_t>(i);
  FromClient(all);
  FromPort(all);
  EXPECT_EQ(port_.sent, all);
  EXPECT_EQ(client_.sent, all);
  EXPECT_EQ(session_.visit().to_port, 256U);
  EXPECT_EQ(session_.visit().from_port, 256U);
}

TEST_F(SessionTest, TheClientIsPausedWhileThePortIsFull) {
  Begin();
  port_.takes = false;
  FromClient(Bytes(Session::kMostForPort + 1));
  EXPECT_TRUE(client_.paused);
  port_.unsent = 0;
  session_.OnPortRoom();
  EXPECT_FALSE(client_.paused);
}

TEST_F(SessionTest, ThePortIsPausedWhileTheClientDoesNotRead) {
  Begin();
  client_.reads = false;
  FromPort(Bytes(Session::kMostForClient + 1));
  EXPECT_TRUE(port_.paused);
  client_.held = 0;
  session_.OnClientRoom();
  EXPECT_FALSE(port_.paused);
}

TEST_F(SessionTest, EndsWhenIdleInBothDirections) {
  Begin();
  Pass(kIdle - 1s);
  FromPort({1});
  Pass(kIdle - 1s);
  FromClient({1});
  Pass(kIdle - 1s);
  EXPECT_EQ(over(), "");
  Pass(1s);
  EXPECT_EQ(over(), "no bytes passed for 1min");
}

TEST_F(SessionTest, EndsWhenIdleBeforeItHasThePort) {
  Pass(kIdle);
  EXPECT_EQ(over(), "no bytes passed for 1min");
}

TEST_F(SessionTest, EndsAtOnceWhenTheClientLeavesAndNothingIsUnsent) {
  Begin();
  session_.OnClientEnd(now_);
  EXPECT_EQ(over(), "it disconnected");
}

TEST_F(SessionTest, EndsAfterTheClientLeftWhenThePortHasSentAll) {
  Begin();
  port_.takes = false;
  FromClient({1, 2, 3});
  session_.OnClientEnd(now_);
  Pass(1s);
  EXPECT_EQ(over(), "");
  port_.unsent = 0;
  Pass(PortDrain::kLookEvery);
  EXPECT_EQ(over(), "it disconnected");
}

TEST_F(SessionTest, BytesSentBeforeItsTurnGoOutBeforeALeavingClientEnds) {
  FromClient({1, 2});
  session_.OnClientEnd(now_);
  Pass(1s);
  EXPECT_EQ(over(), "");
  Begin();
  Pass(PortDrain::kLookEvery);
  EXPECT_EQ(port_.sent, Bytes({1, 2}));
  EXPECT_EQ(over(), "it disconnected");
}

TEST_F(SessionTest, EndsAfterATimeoutWhenThePortTakesNothing) {
  Begin();
  port_.takes = false;
  FromClient({1, 2, 3});
  session_.OnClientEnd(now_);
  Pass(PortDrain::kLongest);
  EXPECT_THAT(over(), HasSubstr("before the port had taken all"));
}

TEST_F(Rfc2217, NegotiatesWithoutThePort) {
  FromClient(*ParseHex("FF FB 2C FF FD 2C FF FD 18"));
  EXPECT_FALSE(session_.asks());
  EXPECT_EQ(ToHex(client_.sent), "FF FB 2C FF FC 18");
}

TEST_F(Rfc2217, ACommandRequestsThePortAndKeepsItsOrder) {
  FromClient(*ParseHex("61 FF FA 2C 02 07 FF F0 62"));
  EXPECT_TRUE(session_.asks());
  EXPECT_TRUE(client_.sent.empty());
  Begin();
  EXPECT_THAT(port_.sent, ElementsAre('a', 'b'));
  EXPECT_THAT(port_.calls, ElementsAre("apply 9600 7N1"));
  EXPECT_THAT(ToHex(client_.sent), HasSubstr("FF FA 2C 66 07 FF F0"));
}

TEST_F(Rfc2217, DoublesTheCommandByteInBothDirections) {
  Begin();
  FromPort({0x61, 0xFF, 0x62});
  EXPECT_EQ(ToHex(client_.sent), "61 FF FF 62");
  FromClient(*ParseHex("61 FF FF 62"));
  EXPECT_EQ(ToHex(port_.sent), "61 FF 62");
}

TEST_F(Rfc2217, IacBrkMakesABreakBetweenTheDataAroundIt) {
  Begin();
  port_.takes = false;
  FromClient(*ParseHex("61 FF F3 62"));
  EXPECT_EQ(ToHex(port_.sent), "61");
  EXPECT_TRUE(client_.paused);
  Pass(100ms);
  EXPECT_TRUE(port_.calls.empty()) << "the port still sends";
  port_.takes = true;
  port_.unsent = 0;
  Pass(Session::kLookBeforeBreak);
  EXPECT_THAT(port_.calls, ElementsAre("break on"));
  Pass(250ms);
  FromClient(*ParseHex("63"));
  EXPECT_EQ(ToHex(port_.sent), "61");
  Pass(50ms);
  EXPECT_THAT(port_.calls, ElementsAre("break on", "break off"));
  EXPECT_EQ(ToHex(port_.sent), "61 62 63");
  EXPECT_FALSE(client_.paused);
}

TEST_F(Rfc2217, IacBrkIsSentThoughThePortTakesNothing) {
  Begin();
  port_.takes = false;
  FromClient(*ParseHex("61 FF F3"));
  Pass(Session::kMostBeforeBreak);
  EXPECT_THAT(port_.calls, ElementsAre("break on"));
}

TEST_F(Rfc2217, IacBrkRequestsThePort) {
  FromClient(*ParseHex("FF F3 FF F3"));
  EXPECT_TRUE(session_.asks());
  Begin();
  Pass(1s);
  EXPECT_THAT(port_.calls, ElementsAre("break on", "break off", "break on", "break off"));
}

TEST_F(Rfc2217, IacBrkDoesNotEndTheBreakOfACommand) {
  Begin();
  FromClient(*ParseHex("FF FA 2C 05 05 FF F0 FF F3"));
  Pass(1s);
  EXPECT_THAT(port_.calls, ElementsAre("break on", "break on", "break on"));
  FromClient(*ParseHex("FF FA 2C 05 06 FF F0"));
  EXPECT_EQ(port_.calls.back(), "break off");
}

TEST_F(Rfc2217, IacBrkDoesNotDelayDataOnAPortWithoutBreaks) {
  port_.no_switches = true;
  Begin();
  FromClient(*ParseHex("61 FF F3 62"));
  EXPECT_EQ(ToHex(port_.sent), "61 62");
}

TEST_F(SessionTest, RawModeTreatsNoByteAsABreak) {
  Begin();
  FromClient(*ParseHex("FF F3"));
  EXPECT_EQ(ToHex(port_.sent), "FF F3");
  EXPECT_TRUE(port_.calls.empty());
}

TEST_F(Rfc2217, PausesAndResumesThePortOnCommand) {
  Begin();
  FromClient(*ParseHex("FF FA 2C 08 FF F0"));
  EXPECT_TRUE(port_.paused);
  FromClient(*ParseHex("FF FA 2C 09 FF F0"));
  EXPECT_FALSE(port_.paused);
}

TEST_F(Rfc2217, ReportsChangesOfControlLines) {
  port_.modem = ModemLines{};
  Begin();
  FromClient(*ParseHex("FF FA 2C 05 07 FF F0"));
  client_.sent.clear();
  Pass(Session::kLookEvery);
  EXPECT_TRUE(client_.sent.empty());
  port_.modem->cts = true;
  Pass(Session::kLookEvery);
  EXPECT_EQ(ToHex(client_.sent), "FF FA 2C 6B 11 FF F0");
  session_.End();
  Pass(Session::kLookEvery);
}

TEST_F(Rfc2217, AFloodOfCommandsWaitsForAClientThatReads) {
  Begin();
  client_.reads = false;
  Bytes flood;
  for (int i = 0; i < 500; ++i) Append(flood, View(*ParseHex("FF FA 2C 02 08 FF F0")));
  std::size_t floods = 0;
  while (!client_.paused && floods < 1000) {
    FromClient(flood);
    ++floods;
  }
  EXPECT_TRUE(client_.paused);
  EXPECT_LT(client_.held, 2 * Session::kMostForClient);
}

}  // namespace
}  // namespace baudgate::serial_server
