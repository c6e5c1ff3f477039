// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/ageing.h"

#include <asio/post.hpp>
#include <utility>

namespace baudgate {

Ageing::Ageing(asio::io_context& io, std::function<void(Instant)> age)
    : timer_(io), age_(std::move(age)) {}

void Ageing::Start() {
  asio::post(timer_.get_executor(), [this] { Tick(); });
}

void Ageing::Tick() {
  const Instant now = ReadClocks().instant;
  age_(now);
  timer_.expires_at(now + kInterval);
  timer_.async_wait([this](const asio::error_code& error) {
    if (!error) Tick();
  });
}

}  // namespace baudgate
