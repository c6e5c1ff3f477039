// Look-ups that hang, and who does not wait for them.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <asio/executor_work_guard.hpp>
#include <asio/ip/tcp.hpp>
#include <asio/post.hpp>
#include <atomic>
#include <functional>
#include <future>
#include <memory>
#include <string>
#include <vector>

#include "tests/transports/far_end.h"
#include "transports/tcp_client.h"

namespace baudgate {
namespace {

/// A name server that never answers for hosts named "dead…" until it is told to; others are this
/// machine.
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
    // The look-ups run in other threads, whose beginning wakes nobody.
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

TEST_F(NamesTest, AnAnswerComesOnTheAskersLoop) {
  Ask("server");
  EXPECT_EQ(answers_, 0) << "never from within the call";
  EXPECT_TRUE(WaitFor([&] { return answers_ == 1; }));
  Ask("unknown");
  EXPECT_TRUE(WaitFor([&] { return answers_ == 101; }));
}

TEST_F(NamesTest, WhoWaitsNoMoreIsNotAnswered) {
  Ask("dropped");
  tickets_.clear();
  Ask("server");
  EXPECT_TRUE(WaitFor([&] { return answers_ > 0; }));
  test::RunReady(io_);
  EXPECT_EQ(answers_, 1);
}

TEST_F(NamesTest, AHostIsLookedUpOnceForAllWhoAsk) {
  for (int i = 0; i < 1000; ++i) Ask("dead");
  Ask("server");
  EXPECT_TRUE(WaitFor([&] { return answers_ == 1; }));
  EXPECT_TRUE(WaitForAsked(1));
  EXPECT_EQ(server_->asked, 2);
}

/// Lines give a server up after 5 s; until then these look-ups take all places.
TEST_F(NamesTest, GivenUpHostsMakeRoom) {
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

/// Threads are bounded however many hosts hang: 16, of which 12 are given up.
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

/// The whole way, on one loop as lines share it.
TEST_F(NamesTest, ADeadNameServerDelaysNoOtherLine) {
  asio::ip::tcp::acceptor acceptor(io_,
                                   asio::ip::tcp::endpoint(asio::ip::address_v4::loopback(), 0));
  const std::string port = ":" + std::to_string(acceptor.local_endpoint().port());
  test::Recorder hanging;
  test::Recorder named;
  test::Recorder numeric;
  const config::SerialSettings serial;
  const auto dead = MakeTcpClient("tcp://dead" + port, serial, io_, hanging, names_);
  const auto by_name = MakeTcpClient("tcp://server" + port, serial, io_, named, names_);
  const auto by_number = MakeTcpClient("tcp://127.0.0.1" + port, serial, io_, numeric, names_);
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
  auto dead = MakeTcpClient("tcp://dead:1", {}, io_, hanging, names_);
  dead->Open();
  ASSERT_TRUE(WaitForAsked(1));
  dead.reset();
  test::RunReady(io_);
  EXPECT_TRUE(hanging.failures.empty());
}

}  // namespace
}  // namespace baudgate
