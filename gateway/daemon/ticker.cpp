// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/ticker.h"

#include <asio/post.hpp>
#include <utility>

namespace baudgate {

Ticker::Ticker(asio::io_context& io, std::function<void(Instant)> tick)
    : timer_(io), tick_(std::move(tick)) {}

void Ticker::Start() {
  asio::post(timer_.get_executor(), [this] { Tick(); });
}

void Ticker::Tick() {
  const Instant now = ReadClocks().instant;
  tick_(now);
  timer_.expires_at(now + kInterval);
  timer_.async_wait([this](const asio::error_code& error) {
    if (!error) Tick();
  });
}

}  // namespace baudgate
