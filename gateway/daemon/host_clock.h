// Looks every few seconds whether the kernel knows this machine's clock to be synchronised (NTP,
// PTP, GPS), and tells when that has changed: only then may devices be told the time.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <asio/steady_timer.hpp>
#include <functional>

namespace baudgate {

/// All on the loop's thread, but Start before it runs. The loop stops before this goes.
class HostClock {
 public:
  /// `tell` hears of the first time that it is right, and of every change.
  HostClock(asio::io_context& io, std::function<void(bool right)> tell);
  void Start();

 private:
  void Tick();

  asio::steady_timer timer_;
  const std::function<void(bool)> tell_;
  bool right_ = false;
};

}  // namespace baudgate
