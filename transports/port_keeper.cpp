// SPDX-License-Identifier: Apache-2.0
#include "transports/port_keeper.h"

#include <filesystem>
#include <system_error>
#include <utility>

namespace baudgate {
namespace {

/// A missing port that cannot be watched is looked for so often.
constexpr Duration kLookForPort = 500ms;

}  // namespace

PortKeeper::PortKeeper(asio::io_context& io, std::string port, std::function<void()> open)
    : port_(std::move(port)),
      network_(port_.starts_with("tcp://")),
      open_(std::move(open)),
      timer_(io),
      watch_(io, port_, [this] { OnPortChange(); }),
      ladder_(static_cast<std::uint32_t>(std::hash<std::string>{}(port_))) {}

void PortKeeper::Stop() {
  waiting_.reset();
  timer_.cancel();
  watch_.Stop();
  ladder_.Reset();
  told_.clear();
}

void PortKeeper::OnOpened() {
  if (!network_) return Stop();
  waiting_.reset();
  timer_.cancel();
}

bool PortKeeper::OnDown(const std::string& reason) {
  if (!network_ && !told_.contains(reason)) told_.clear();
  const bool news = told_.insert(reason).second;
  // First watched, then looked at: what comes between is not lost.
  const bool watching = !network_ && (watch_.watching() || watch_.Start());
  if (!IsMissing()) {
    TryIn(ladder_.Next());
  } else {
    ladder_.Reset();
    if (!watching) TryIn(kLookForPort);
  }
  return news;
}

void PortKeeper::TryIn(Duration wait) {
  waiting_ = std::make_shared<char>();
  timer_.expires_after(wait);
  timer_.async_wait([this, waiting = std::weak_ptr(waiting_)](const asio::error_code& error) {
    if (!error && !waiting.expired()) Try();
  });
}

/// The port has appeared, or somebody has been given the right to it.
void PortKeeper::OnPortChange() {
  waiting_.reset();
  timer_.cancel();
  ladder_.Reset();
  Try();
}

/// A port that is still missing has nothing new to tell.
void PortKeeper::Try() {
  if (!IsMissing()) return open_();
  ladder_.Reset();
  if (!watch_.watching()) TryIn(kLookForPort);
}

bool PortKeeper::IsMissing() const {
  std::error_code error;
  return !network_ && !std::filesystem::exists(port_, error);
}

}  // namespace baudgate
