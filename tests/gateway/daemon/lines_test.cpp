// Lines that a reload ends while their drivers hang.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/lines.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace baudgate
