// Makes stored values old: tells the point store a few times a second what time it is, so that its
// feeds hear of every value that nobody has read again. Any build and any output: without DDS, too.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <asio/steady_timer.hpp>
#include <functional>

#include "gateway/base/time.h"

namespace baudgate {

/// All on the loop's thread, but Start before it runs. The loop stops before this goes.
class AgeTimer {
 public:
  /// An edge from good to uncertain is told at most this late.
  static constexpr Duration kInterval = 200ms;

  /// `age` is PointStore::Age.
  AgeTimer(asio::io_context& io, std::function<void(Instant now)> age);
  void Start();

 private:
  void Tick();

  asio::steady_timer timer_;
  const std::function<void(Instant)> age_;
};

}  // namespace baudgate
