// Lines that a reload ends while their drivers hang.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/lines/lines.h"

#include <gmock/gmock.h>

#include <asio/ip/tcp.hpp>
#include <asio/post.hpp>
#include <atomic>
#include <cstdint>
#include <future>
#include <memory>

#include "tests/support/toy_protocol.h"
#include "tests/support/virtual_line.h"

namespace baudgate {
namespace {

struct CountedNews final : EventSink {
  void OnReported(ReportedEvents) override {}
  void OnDrained(std::uint32_t, Instant) override {}
  void OnNews(const config::Line&, const News& news, Now) override {
    if (news.text == "too late") ++late;
  }
  void OnRead(std::uint32_t, std::span<const std::uint32_t>, Now) override {}

  std::atomic<int> late = 0;
};

/// A line of the same name has begun meanwhile: it would have the alarm.
TEST(Lines, OneThatWasAbandonedTellsNothingWhenItsDriverReturns) {
  config::Config config;
  config.lines = {ToyLine({ToyDevice("a", "A", {"1"})})};
  config.lines[0].port = "/dev/not-there";
  PointStore store(config);
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
    its.reporter.OnNews({News::What::port_down, false, {}, "too late"}, now);
  });
  const std::uint32_t number = 0;
  lines.Remove(std::span(&number, 1));
  returns.set_value();
  lines.End();
  EXPECT_EQ(news.late, 0);
}

/// What a reload answers with: a line that runs and can be reached by nobody is no success.
TEST(Lines, StartedInVainSayWhatTheyCannotOpen) {
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
  PointStore store(config);
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
  const std::string in_vain = ": no client can come in at " + taken.Address() + ": address already";
  using ::testing::StartsWith;
  EXPECT_THAT(lines.NotOpen(numbers), ::testing::ElementsAre(StartsWith("line lent" + in_vain),
                                                             StartsWith("line served" + in_vain),
                                                             StartsWith("line unplugged: ")));
}

}  // namespace
}  // namespace baudgate
