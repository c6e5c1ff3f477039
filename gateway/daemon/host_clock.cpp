// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/host_clock.h"

#include <asio/post.hpp>
#include <utility>

#include "gateway/base/time.h"

namespace baudgate {
namespace {

constexpr auto kInterval = 5s;

}  // namespace

HostClock::HostClock(asio::io_context& io, std::function<void(bool)> tell)
    : timer_(io), tell_(std::move(tell)) {}

void HostClock::Start() {
  asio::post(timer_.get_executor(), [this] { Tick(); });
}

void HostClock::Tick() {
  const bool right = IsClockSynchronised();
  if (std::exchange(right_, right) != right) tell_(right);
  timer_.expires_after(kInterval);
  timer_.async_wait([this](const asio::error_code& error) {
    if (!error) Tick();
  });
}

}  // namespace baudgate
