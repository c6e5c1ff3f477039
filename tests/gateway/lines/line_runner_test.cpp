// Lines that share a loop, on real sockets: what ends one leaves the other alone.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/lines/line_runner.h"

#include <gtest/gtest.h>

#include <asio/ip/tcp.hpp>
#include <functional>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include "tests/support/toy_protocol.h"
#include "tests/support/virtual_line.h"
#include "tests/transports/far_end.h"
#include "transports/loop_thread.h"

namespace baudgate {
namespace {

using asio::ip::tcp;
using Far = test::FarEnd<tcp::socket>;

class SharedLoop : public testing::Test {
 protected:
  SharedLoop() {
    config_.lines = {LineOn(0), LineOn(1)};
    store_ = std::make_unique<PointStore>(config_);
    for (std::uint32_t i = 0; i < 2; ++i) {
      runners_.push_back(std::make_unique<LineRunner>(
          loop_.io(), config_.lines[i], i,
          [](const std::string&) -> const Protocol& { return ToyProtocol(); }, *store_));
      Accept(i);
    }
    loop_.Start();
    for (const auto& runner : runners_) runner->Start();
    EXPECT_TRUE(WaitFor([&] { return accepted_[0] == 1 && accepted_[1] == 1; }));
  }

  config::Line LineOn(std::size_t server) {
    config::Line line = ToyLine({ToyDevice("d" + std::to_string(server), "A", {"1"})});
    line.name = "line" + std::to_string(server);
    line.port = "tcp://127.0.0.1:" + std::to_string(servers_[server].local_endpoint().port());
    return line;
  }
  void Accept(std::size_t server) {
    servers_[server].async_accept([this, server](const std::error_code& error, tcp::socket socket) {
      if (error) return;
      ++accepted_[server];
      ends_[server] = std::make_unique<Far>(std::move(socket));
      ends_[server]->Start();
      Accept(server);
    });
  }
  bool WaitFor(const std::function<bool()>& condition) { return test::RunUntil(io_, condition); }
  /// The line asks for its device again.
  bool GoesOn(std::size_t line) {
    const std::size_t before = ends_[line]->received().size();
    return WaitFor([&] { return ends_[line]->received().size() > before; });
  }

  asio::io_context io_;
  tcp::acceptor servers_[2] = {Listening(io_), Listening(io_)};
  int accepted_[2] = {};
  std::unique_ptr<Far> ends_[2];
  config::Config config_;
  std::unique_ptr<PointStore> store_;
  LoopThread loop_{"lines"};
  std::vector<std::unique_ptr<LineRunner>> runners_;

 private:
  static tcp::acceptor Listening(asio::io_context& io) {
    return tcp::acceptor(io, tcp::endpoint(asio::ip::address_v4::loopback(), 0));
  }
};

TEST_F(SharedLoop, BothLinesAsk) {
  EXPECT_TRUE(GoesOn(0));
  EXPECT_TRUE(GoesOn(1));
}

TEST_F(SharedLoop, ALineThatStopsLeavesTheOtherAlone) {
  runners_[0]->Stop();
  EXPECT_TRUE(WaitFor([&] { return ends_[0]->ended(); }));
  EXPECT_FALSE(runners_[0]->is_open());
  runners_[0].reset();
  EXPECT_TRUE(GoesOn(1));
}

TEST_F(SharedLoop, AReleasedPortComesBackAndTheOtherGoesOn) {
  runners_[0]->Post([](LineParts& line, Now now) { line.port.Release(1h, now); });
  EXPECT_TRUE(WaitFor([&] { return ends_[0]->ended(); }));
  EXPECT_TRUE(GoesOn(1));
  runners_[0]->Post([](LineParts& line, Now now) { line.port.EndRelease(now); });
  EXPECT_TRUE(WaitFor([&] { return accepted_[0] == 2; }));
  EXPECT_EQ(accepted_[1], 1);
}

TEST_F(SharedLoop, AServerThatClosesIsTriedAgainAndTheOtherGoesOn) {
  ends_[0]->stream().close();
  EXPECT_TRUE(WaitFor([&] { return accepted_[0] == 2; }));
  EXPECT_EQ(accepted_[1], 1);
  EXPECT_TRUE(GoesOn(1));
}

TEST_F(SharedLoop, ManyStopsAtOnceEnd) {
  for (const auto& runner : runners_) runner->RequestStop();
  for (const auto& runner : runners_) runner->Stop();
  for (const auto& runner : runners_) EXPECT_FALSE(runner->is_open());
}

}  // namespace
}  // namespace baudgate
