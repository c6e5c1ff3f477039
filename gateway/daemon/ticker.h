// `Ticker` calls a function five times a second, for parts that have no thread: the point store,
// which reports values that have become too old, the correction of clocks, and the records. It runs
// on a loop that never blocks.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <asio/post.hpp>
#include <asio/steady_timer.hpp>
#include <functional>
#include <utility>

#include "gateway/base/time.h"

namespace baudgate::daemon {

/// All calls must come from the loop's thread, except Start before the loop runs. The loop must
/// stop before the Ticker is destroyed.
class Ticker {
 public:
  /// A value that becomes uncertain by its age is reported at most this time later.
  static constexpr Duration kInterval = 200ms;

  Ticker(asio::io_context& io, std::function<void(Instant now)> tick)
      : timer_(io), tick_(std::move(tick)) {}
  void Start() {
    asio::post(timer_.get_executor(), [this] { Tick(); });
  }

 private:
  void Tick() {
    const Instant now = ReadClocks().instant;
    tick_(now);
    timer_.expires_at(now + kInterval);
    timer_.async_wait([this](const asio::error_code& error) {
      if (!error) Tick();
    });
  }

  asio::steady_timer timer_;
  const std::function<void(Instant)> tick_;
};

}  // namespace baudgate::daemon
