// Which clients are told that their sockets are ready: all of them, again and again, but never one
// that has been removed.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <deque>
#include <functional>

#include "gateway/outputs/modbus/server/client_session.h"

namespace baudgate::modbus {
namespace {

class TestClient : public ClientPoll::Client {
 public:
  explicit TestClient(ClientPoll& clients) : clients_(clients) {
    EXPECT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, ends_), 0);
    EXPECT_TRUE(clients_.Add(ends_[0], *this, EPOLLIN));
  }
  ~TestClient() {
    Leave();
    ::close(ends_[0]);
    ::close(ends_[1]);
  }
  TestClient(const TestClient&) = delete;

  void Send() { EXPECT_EQ(::send(ends_[1], "x", 1, 0), 1); }
  void Leave() { clients_.Remove(ends_[0], *this); }
  void Watch(std::uint32_t events) { EXPECT_TRUE(clients_.Change(ends_[0], *this, events)); }

  void OnEvents(std::uint32_t events, const Now&) override {
    ++told;
    last_events = events;
    char byte = 0;
    if (reads) reads = ::recv(ends_[0], &byte, 1, 0) == 1;
    if (then) then();
  }

  int told = 0;
  std::uint32_t last_events = 0;
  bool reads = true;
  std::function<void()> then;

 private:
  ClientPoll& clients_;
  int ends_[2] = {-1, -1};
};

class ClientPollTest : public testing::Test {
 protected:
  ClientPollTest() {
    EXPECT_TRUE(clients_->Open().ok());
    clients_->Start();
  }
  ~ClientPollTest() override {
    all_.clear();
    clients_->Close();
  }

  TestClient& Join() { return all_.emplace_back(*clients_); }

  asio::io_context io_;
  std::shared_ptr<ClientPoll> clients_ = std::make_shared<ClientPoll>(io_);
  std::deque<TestClient> all_;
};

TEST_F(ClientPollTest, MoreThanOneBatchIsServedOnceEach) {
  for (int i = 0; i < 300; ++i) Join().Send();
  io_.poll();
  for (const TestClient& client : all_) EXPECT_EQ(client.told, 1);
}

TEST_F(ClientPollTest, WhatIsNotReadIsToldAgainAndOtherWorkHasItsTurn) {
  TestClient& lazy = Join();
  TestClient& other = Join();
  lazy.reads = other.reads = false;
  lazy.Send();
  other.Send();
  bool ran = false;
  clients_->Post([&](const Now&) { ran = true; });
  while (lazy.told < 1000 && io_.run_one() > 0) continue;
  EXPECT_TRUE(ran);
  EXPECT_GE(other.told, 900);
}

TEST_F(ClientPollTest, AClientThatAnotherRemovesIsNotTold) {
  TestClient& first = Join();
  TestClient& second = Join();
  first.then = [&] { second.Leave(); };
  second.then = [&] { first.Leave(); };
  first.Send();
  second.Send();
  io_.poll();
  EXPECT_EQ(first.told + second.told, 1);
}

TEST_F(ClientPollTest, TheOnlyClientIsServedAloneUntilAnotherComes) {
  TestClient& only = Join();
  for (int i = 1; i <= 3; ++i) {
    only.Send();
    io_.poll();
    EXPECT_EQ(only.told, i);
  }
  TestClient& other = Join();
  other.Send();
  io_.poll();
  EXPECT_EQ(only.told, 3);
  EXPECT_EQ(other.told, 1);
  only.Leave();
  other.Send();
  io_.poll();
  EXPECT_EQ(only.told, 3);
  EXPECT_EQ(other.told, 2);
}

TEST_F(ClientPollTest, TheOnlyClientIsToldOfWhatItWatchesNow) {
  TestClient& only = Join();
  only.Send();
  io_.poll();
  only.Watch(0);
  only.Send();
  io_.poll();
  EXPECT_EQ(only.told, 1);
  only.then = [&] { only.Watch(0); };
  only.Watch(EPOLLOUT);
  io_.poll();
  EXPECT_EQ(only.told, 2);
  EXPECT_EQ(only.last_events, static_cast<std::uint32_t>(EPOLLOUT));
}

}  // namespace
}  // namespace baudgate::modbus
