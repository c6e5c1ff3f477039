// Tests of writes that a line cannot accept, of lines that share a loop, and of removed lines.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <asio/ip/tcp.hpp>
#include <asio/post.hpp>
#include <atomic>
#include <cstdint>
#include <functional>
#include <future>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include "gateway/lines/line_runner.h"
#include "gateway/lines/lines.h"
#include "tests/support/toy_protocol.h"
#include "tests/support/virtual_line.h"
#include "tests/transports/far_end.h"
#include "transports/loop_thread.h"

namespace baudgate::lines {
namespace {

class LineDispatcherTest : public ::testing::Test {
 protected:
  LineDispatcherTest() {
    catalog_.protocols["toy"] = &ToyProtocol();
    config::Line line = ToyLine({ToyDevice("a", "A", {"1"})});
    line.protocol = "toy";
    line.port = "tcp://127.0.0.1:1";
    config_.lines = {line};
    store_ = std::make_unique<bus::PointStore>(config_);
    lines_ = std::make_unique<Lines>(*store_, catalog_, 1);
    lines_->Add({std::shared_ptr<void>(), config_.lines.data()});
    dispatcher_ = std::make_unique<LineDispatcher>(*store_, catalog_, *lines_);
  }

  bool Write(std::uint32_t device = 0) {
    bus::WriteCommand command;
    command.device = device;
    command.client = "user:anna";
    command.kind = bus::Writes{{0, 1.0}};
    command.done = [this](const WriteResult& result) { result_ = result; };
    return dispatcher_->Submit(std::move(command));
  }
  std::uint64_t Counted(WriteEnd end, std::uint32_t device = 0) const {
    std::uint64_t count = 0;
    store_->Read(device, [&](const bus::DeviceRecord& record) {
      count = record.status.writes.ends[static_cast<std::size_t>(end)];
    });
    return count;
  }

  config::Catalog catalog_;
  config::Config config_;
  std::unique_ptr<bus::PointStore> store_;
  std::unique_ptr<Lines> lines_;
  std::unique_ptr<LineDispatcher> dispatcher_;
  std::optional<WriteResult> result_;
};

TEST_F(LineDispatcherTest, AWriteToALineThatHangsIsNotSent) {
  lines_->at(0).With([](LineRunner& runner) { runner.SetStuck(ReadClocks().wall); });
  EXPECT_TRUE(Write());
  ASSERT_TRUE(result_);
  EXPECT_EQ(result_->end, WriteEnd::not_sent);
  EXPECT_EQ(result_->reason,
            "the driver of its line's port does not answer; check the adapter (dmesg)");
  EXPECT_EQ(Counted(WriteEnd::not_sent), 1U);
}

TEST_F(LineDispatcherTest, AWriteToALineEndedByAReloadIsNotSent) {
  const auto ended = lines_->at(0).Take();
  EXPECT_TRUE(Write());
  ASSERT_TRUE(result_);
  EXPECT_EQ(result_->end, WriteEnd::not_sent);
  EXPECT_EQ(Counted(WriteEnd::not_sent), 1U);
}

TEST_F(LineDispatcherTest, ARoutedRequestToAnEndedLineIsLineDown) {
  const auto ended = lines_->at(0).Take();
  std::optional<bus::RoutedReply> reply;
  bus::RoutedRequest request;
  request.pdu = {3, 0, 0, 0, 1};
  request.done = [&](bus::RoutedReply said) { reply = std::move(said); };
  EXPECT_TRUE(lines_->at(0).Submit(std::move(request)));
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->outcome, Outcome::line_down);
  EXPECT_EQ(reply->reason, LineSlot::kNotThere);
  EXPECT_FALSE(reply->sent);
}

TEST_F(LineDispatcherTest, AWriteToALineThatAReloadIsAddingIsNotSent) {
  config::Line added = config_.lines[0];
  added.name = "added";
  store_->Append(std::make_shared<const config::Line>(added));
  EXPECT_TRUE(Write(1));
  ASSERT_TRUE(result_);
  EXPECT_EQ(result_->end, WriteEnd::not_sent);
  dispatcher_->SetInUse(1, true, "user:anna");
  dispatcher_->Release(1, 1s);
  EXPECT_EQ(Counted(WriteEnd::not_sent, 1), 1U);
}

TEST_F(LineDispatcherTest, AFullQueueIsBusyAndCounted) {
  int taken = 0;
  while (taken < 1000 && Write()) ++taken;
  EXPECT_EQ(taken, 16) << "half of the room for one client";
  EXPECT_EQ(Counted(WriteEnd::busy), 1U);
  EXPECT_FALSE(result_);
}

TEST_F(LineDispatcherTest, RefusedCommandsAreCountedByTheirEnd) {
  dispatcher_->OnNotTaken({.client = "user:anna", .point = 0});
  dispatcher_->OnNotTaken({.client = "user:anna", .point = 0, .end = WriteEnd::busy});
  dispatcher_->OnNotTaken({.client = "user:anna", .point = 1, .counts = false});
  EXPECT_EQ(Counted(WriteEnd::denied), 1U) << "a command of two points is one write";
  EXPECT_EQ(Counted(WriteEnd::busy), 1U);
}

TEST_F(LineDispatcherTest, ADeniedManualTelegramIsNotCountedAsAWrite) {
  dispatcher_->OnNotTaken({.client = "user:anna", .value = std::string("3E **")});
  EXPECT_EQ(Counted(WriteEnd::denied), 0U);
}

using asio::ip::tcp;
using Far = test::FarEnd<tcp::socket>;

class SharedLoop : public testing::Test {
 protected:
  SharedLoop() {
    config_.lines = {LineOn(0), LineOn(1)};
    store_ = std::make_unique<bus::PointStore>(config_);
    for (std::uint32_t i = 0; i < 2; ++i) {
      runners_.push_back(std::make_unique<LineRunner>(
          loop_.io(), store_->LineAt(i), i,
          [](const std::string&) -> const protocols::Protocol& { return ToyProtocol(); }, *store_));
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
  bool GoesOn(std::size_t line) {
    const std::size_t before = ends_[line]->received().size();
    return WaitFor([&] { return ends_[line]->received().size() > before; });
  }

  asio::io_context io_;
  tcp::acceptor servers_[2] = {Listening(io_), Listening(io_)};
  int accepted_[2] = {};
  std::unique_ptr<Far> ends_[2];
  config::Config config_;
  std::unique_ptr<bus::PointStore> store_;
  transports::LoopThread loop_{"lines"};
  std::vector<std::unique_ptr<LineRunner>> runners_;

 private:
  static tcp::acceptor Listening(asio::io_context& io) {
    return tcp::acceptor(io, tcp::endpoint(asio::ip::address_v4::loopback(), 0));
  }
};

TEST_F(SharedLoop, BothLinesSendRequests) {
  EXPECT_TRUE(GoesOn(0));
  EXPECT_TRUE(GoesOn(1));
}

TEST_F(SharedLoop, AStoppedLineDoesNotStopTheOtherLine) {
  runners_[0]->Stop();
  EXPECT_TRUE(WaitFor([&] { return ends_[0]->ended(); }));
  EXPECT_FALSE(runners_[0]->is_open());
  runners_[0].reset();
  EXPECT_TRUE(GoesOn(1));
}

TEST_F(SharedLoop, AReleasedPortComesBackAndTheOtherLineContinues) {
  runners_[0]->Post([](LineParts& line, Now now) { line.port.Release(1h, now); });
  EXPECT_TRUE(WaitFor([&] { return ends_[0]->ended(); }));
  EXPECT_TRUE(GoesOn(1));
  runners_[0]->Post([](LineParts& line, Now now) { line.port.EndRelease(now); });
  EXPECT_TRUE(WaitFor([&] { return accepted_[0] == 2; }));
  EXPECT_EQ(accepted_[1], 1);
}

TEST_F(SharedLoop, AServerThatClosesIsRetriedAndTheOtherLineContinues) {
  ends_[0]->stream().close();
  EXPECT_TRUE(WaitFor([&] { return accepted_[0] == 2; }));
  EXPECT_EQ(accepted_[1], 1);
  EXPECT_TRUE(GoesOn(1));
}

TEST_F(SharedLoop, ManyStopsAtOnceComplete) {
  for (const auto& runner : runners_) runner->RequestStop();
  for (const auto& runner : runners_) runner->Stop();
  for (const auto& runner : runners_) EXPECT_FALSE(runner->is_open());
}

struct CountedNews final : bus::EventSink {
  void OnReported(bus::ReportedEvents) override {}
  void OnDrained(std::uint32_t, Instant) override {}
  void OnNews(const config::Line&, const bus::News& news, Now) override {
    if (news.text == "too late") ++late;
  }
  void OnRead(std::uint32_t, std::span<const std::uint32_t>, Now) override {}

  std::atomic<int> late = 0;
};

/// The alarm of a removed line would be taken for an alarm of a new line with the same name.
TEST(Lines, AnAbandonedLineReportsNothingWhenItsDriverReturns) {
  config::Config config;
  config.lines = {ToyLine({ToyDevice("a", "A", {"1"})})};
  config.lines[0].port = "/dev/not-there";
  bus::PointStore store(config);
  config::Catalog catalog;
  catalog.protocols["toy"] = &ToyProtocol();
  CountedNews news;
  Lines lines(store, catalog, 1);
  lines.Link({.events = &news});
  const std::shared_ptr<const config::Line> line(std::shared_ptr<void>(), config.lines.data());
  auto loop = Lines::MakeLoop(*line);
  ASSERT_TRUE(loop);
  lines.Add(line, *loop);
  lines.Start();
  std::promise<void> returns;
  asio::post((*loop)->io(), [hangs = returns.get_future().share()] { hangs.wait(); });
  lines.at(0).Post([](LineParts& its, Now now) {
    its.reporter.OnNews({bus::News::What::port_down, false, {}, "too late"}, now);
  });
  const std::uint32_t number = 0;
  lines.Remove(std::span(&number, 1));
  returns.set_value();
  lines.End();
  EXPECT_EQ(news.late, 0);
}

TEST(Lines, LinesThatCannotOpenReportTheirReason) {
  asio::io_context io;
  const asio::ip::tcp::acceptor other(io, {asio::ip::address_v4::loopback(), 0});
  const auto server_at = [](std::uint16_t port) {
    config::PortServer server;
    server.at = {"127.0.0.1", port};
    return server;
  };
  const config::PortServer taken = server_at(other.local_endpoint().port());
  config::Config config;
  const auto add = [&](const char* name, const char* port) -> config::Line& {
    config::Line line = ToyLine({ToyDevice("a", "A", {"1"})});
    line.name = name;
    line.port = port;
    return config.lines.emplace_back(line);
  };
  config.lines.reserve(4);
  add("lent", "tcp://127.0.0.1:1").lend = taken;
  add("served", "tcp://127.0.0.1:1").serial_server = taken;
  add("unplugged", "/dev/not-there");
  add("well", "tcp://127.0.0.1:1").lend = server_at(0);
  bus::PointStore store(config);
  config::Catalog catalog;
  catalog.protocols["toy"] = &ToyProtocol();
  Lines lines(store, catalog, 1);
  const std::vector<std::uint32_t> numbers = {0, 1, 2, 3};
  for (const std::uint32_t number : numbers) {
    const std::shared_ptr<const config::Line> line(std::shared_ptr<void>(), &config.lines[number]);
    auto loop = Lines::MakeLoop(*line);
    ASSERT_TRUE(loop);
    lines.Add(line, *std::move(loop));
  }
  lines.Start();
  const std::string in_vain = ": no client can connect at " + taken.Address() + ": address already";
  using ::testing::StartsWith;
  EXPECT_THAT(lines.NotOpen(numbers), ::testing::ElementsAre(StartsWith("line lent" + in_vain),
                                                             StartsWith("line served" + in_vain),
                                                             StartsWith("line unplugged: ")));
}

std::vector<config::Line> LinesOn(const std::vector<std::string>& ports) {
  std::vector<config::Line> lines(ports.size());
  for (std::size_t i = 0; i < ports.size(); ++i) lines[i].port = ports[i];
  return lines;
}

struct Row {
  std::string port;
  ThreadKind place;
};

TEST(Placement, TheFormOfThePortSelectsTheThreadOfALine) {
  const std::vector<Row> rows = {
      {"tcp://moxa:4001", ThreadKind::shared_loop},
      {"tcp://[::1]:4001", ThreadKind::shared_loop},
      {"/dev/pts/7", ThreadKind::shared_loop},
      {"/dev/ttyUSB0", ThreadKind::own_thread},
      {"/dev/ttyS1", ThreadKind::own_thread},
      {"/dev/serial/by-id/usb-FTDI", ThreadKind::own_thread},
      {"/tmp/port", ThreadKind::own_thread},  // the link can lead to a port of any kind
      {"ttyUSB0", ThreadKind::own_thread},
      {"", ThreadKind::own_thread},
  };
  for (const Row& row : rows) EXPECT_EQ(ThreadKindOf(row.port), row.place) << row.port;
}

TEST(Placement, TheNumberOfSharedLoopsFollowsCoresAndLines) {
  const auto loops = [](std::size_t lines, std::size_t cores) {
    return SharedLoops(LinesOn(std::vector<std::string>(lines, "tcp://a:1")), cores);
  };
  EXPECT_EQ(loops(1000, 64), 4U);
  EXPECT_EQ(loops(1000, 2), 2U);
  EXPECT_EQ(loops(1000, 0), 1U) << "nobody knows how many cores there are";
  EXPECT_EQ(loops(3, 8), 3U);
  EXPECT_EQ(loops(0, 8), 1U) << "for what is not a line";
  EXPECT_EQ(SharedLoops(LinesOn({"tcp://a:1", "/dev/ttyS0", "/dev/ttyS1", "tcp://b:1"}), 8), 2U)
      << "others have their own";
}

}  // namespace
}  // namespace baudgate::lines
