// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/age_timer.h"

#include <asio/post.hpp>
#include <utility>

namespace baudgate {

AgeTimer::AgeTimer(asio::io_context& io, std::function<void(Instant)> age)
    : timer_(io), age_(std::move(age)) {}

void AgeTimer::Start() {
  asio::post(timer_.get_executor(), [this] { Tick(); });
}

void AgeTimer::Tick() {
  const Instant now = ReadClocks().instant;
  age_(now);
  timer_.expires_at(now + kInterval);
  timer_.async_wait([this](const asio::error_code& error) {
    if (!error) Tick();
  });
}

}  // namespace baudgate
